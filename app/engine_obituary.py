"""What is said of an engine that ended on its own."""

from __future__ import annotations

import signal


def obituary(code: int | None, *, busy: bool, again: bool) -> str:
    """What happened, for people.

    Args:
        code: Exit code of the process; negative for a signal.
        busy: Whether it had a job.
        again: Whether a new one is started.
    """
    if code is not None and code < 0:
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = f"signal {-code}"
        how = f"The bake engine was ended by {name}"
        if name == "SIGKILL":
            how += ", which is what a system short of memory does"
    else:
        how = f"The bake engine ended unexpectedly (exit code {code})"
    what = "; the bake is lost, stored results are untouched" if busy else "; nothing was lost"
    then = ". A new one is starting." if again else ". It keeps failing and stays down until the next bake."
    return how + what + then
