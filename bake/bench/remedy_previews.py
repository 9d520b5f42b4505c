"""Whether the preview of a remedy is the rebake that follows: injected defects, mended one at a time, baked again."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from bake.bench.cause_rounds import Round, bake_scene
from bake.bench.table import Measurements
from bake.explain.cause_types import Remedy
from bake.explain.causes import name_causes
from bake.explain.explainer import Explainer
from bake.explain.preview import Previewer
from bake.explain.remedies import remedied, remedied_settings

EQUAL = 1e-3
"""AO by which a preview may differ from the rebake, at the spot and at any distance."""


@dataclass(frozen=True, slots=True)
class Mended:
    """One remedy, previewed and baked.

    Attributes:
        site: Name of the scene.
        kind: Of the remedy.
        cause: That it was offered against.
        before, after: AO at the spot, as baked and as baked again, at the distance at which the defect shows.
        difference: Largest difference between preview and rebake at the spot, over all distances.
        around: The same over the vertices around that the preview shows.
        traced: Share of the rebake's samples that the preview traced.
    """

    site: str
    kind: str
    cause: str
    before: float
    after: float
    difference: float
    around: float
    traced: float


def mend_round(made: Round, site: str, known: Set[str] = frozenset()) -> Iterator[Mended]:
    """Previews what is offered against each injection that came out as meant, and bakes it: each kind once.

    Args:
        made: A bake with injections.
        site: Name of the scene.
        known: Kinds of remedies to leave out.
    """
    done = set(known)
    with Explainer(made.result) as explainer:
        previewer = Previewer(explainer, made.scene)
        for number, item in enumerate(made.placed):
            if not made.manifest(number):
                continue
            explanation = explainer.explain_face(int(made.face[number]), made.weights[number])
            distance = made.result.settings.column_distances[item.injection.column]
            cause = name_causes(explainer, explanation, distance=distance)[0]
            for remedy in cause.remedies:
                if remedy.writes and _name(remedy) not in done:
                    done.add(_name(remedy))
                    preview = previewer.preview(explanation.spot, remedy)
                    again = bake_scene(remedied(made.scene, remedy), remedied_settings(made.result.settings, remedy))
                    baked = again.field.ao.astype(np.float64)
                    spot = explanation.spot.weights @ baked[explanation.spot.vertices]
                    column = item.injection.column
                    yield Mended(
                        site,
                        _name(remedy),
                        str(cause.kind),
                        float(explanation.value[column]),
                        float(spot[column]),
                        _apart(preview.after, spot),
                        _apart(preview.ao, baked[preview.vertices]),
                        preview.samples / max(len(again.samples), 1),
                    )


def preview_table(mended: Sequence[Mended], *, seeds: Mapping[str, int]) -> Measurements:
    """One row a kind of remedy over all scenes; the last row holds the largest difference of all."""
    groups: dict[str, list[Mended]] = defaultdict(list)
    for item in mended:
        groups[item.kind].append(item)
    rows: list[dict[str, Any]] = [_row(kind, items) for kind, items in sorted(groups.items())]
    if mended:
        rows.append(_row("all", mended) | {"passed": max(item.difference for item in mended) <= EQUAL})
    return Measurements(
        "previews",
        rows,
        [
            "largest difference in AO between the preview and the bake that follows, at the spot and around it",
            f"gate: at most {EQUAL:g} at every spot",
        ],
        seeds=seeds,
    )


def _row(kind: str, items: Sequence[Mended]) -> dict[str, Any]:
    return {
        "remedy": kind,
        "scenes": len({item.site for item in items}),
        "previews": len(items),
        "largest difference": max(item.difference for item in items),
        "largest around": max(item.around for item in items),
        "mean AO before": float(np.mean([item.before for item in items])),
        "mean AO after": float(np.nanmean([item.after for item in items])),
        "samples traced %": 100.0 * float(np.mean([item.traced for item in items])),
    }


def _name(remedy: Remedy) -> str:
    """The keys and options that it writes, with their values where these are words."""
    said = {key: value for keys in remedy.objects.values() for key, value in keys.items()} | dict(remedy.options)
    return (
        ", ".join(f"{key} = {value}" if isinstance(value, str | bool) else key for key, value in sorted(said.items()))
        .replace("True", "true")
        .replace("False", "false")
    )


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference; infinite where only one of them has a value."""
    if (np.isnan(one) != np.isnan(other)).any():
        return float("inf")
    return float(np.nanmax(np.abs(one - other), initial=0.0))
