"""Finding a text by some of its letters, the way people type them."""

from __future__ import annotations

_START, _RUN, _GAP, _FIRST = 8.0, 5.0, 0.15, 4.0


def fuzzy_score(query: str, text: str) -> float | None:
    """How well a text answers a query; higher is better.

    Every letter of the query must occur in the text in the same order; letters that begin a word and letters that
    follow each other count more, letters that are passed over count a little against it.

    Args:
        query: What was typed; case and blanks do not matter.
        text: What it may mean.

    Returns:
        The score, or None if the text does not answer the query.
    """
    wanted, letters = "".join(query.lower().split()), text.lower()
    if not wanted:
        return 0.0
    # best[j]: best score of the letters so far with the last of them at j.
    best: dict[int, float] = {}
    for number, letter in enumerate(wanted):
        following: dict[int, float] = {}
        for place, found in enumerate(letters):
            if found != letter:
                continue
            own = 1.0
            if place == 0 or not letters[place - 1].isalnum():
                own += _START + (_FIRST if place == 0 else 0.0)
            if number == 0:
                following[place] = own - _GAP * place
                continue
            reached = [
                score + (_RUN if place == before + 1 else -_GAP * (place - before - 1))
                for before, score in best.items()
                if before < place
            ]
            if reached:
                following[place] = own + max(reached)
        best = following
        if not best:
            return None
    return max(best.values()) - 0.01 * len(letters)
