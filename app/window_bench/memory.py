"""Memory of window and engine over many edits in a row, each of them followed by a rebake."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from app.engine_worker import resident_memory_mb
from app.parts.placing import PlacingPart
from app.parts.rebake import RebakePart
from app.window_bench.driver import Driver
from bake.errors import ObscuraError
from viewer.gizmo import Motion

GROWTH = 0.05
WARM = 40
"""Edits after which all that is kept once is there: the layers that can be undone, the session, compiled kernels."""

MEMORY_NOTES = (
    f"memory that each process has for itself; growth from the {WARM}th edit to the last, one prop moved to and fro "
    "with rebakes at once",
    f"gate: {GROWTH:.0%}",
)
_PATIENCE_MS = 120_000
_SPAN = 8


def edits_in_a_row(driver: Driver, count: int) -> list[dict[str, Any]]:
    """Moves the selected object again and again with the toggle on; a row for each process.

    Raises:
        ObscuraError: the window did not follow.
    """
    window = driver.window
    part, rebaker = window.part(PlacingPart), window.part(RebakePart).rebaker
    sizes: list[tuple[float, float]] = []
    for number in range(count):
        done = rebaker.timing
        part.place_by(Motion((0.3 if number % 2 else -0.3, 0.0, 0.0)))
        waited = 0
        while rebaker.timing is done or rebaker.is_busy or not window.controller.is_idle:
            driver.wait(20)
            waited += 20
            if waited > _PATIENCE_MS:
                raise ObscuraError("the window did not follow", where="bench edits", remedy="run it on an idle machine")
        sizes.append((own_memory_mb(None), own_memory_mb(window.engine.pid)))
    begin = min(WARM, count // 2)
    rows: list[dict[str, Any]] = []
    for column, name in enumerate(("window", "engine")):
        # What is freed comes back in steps: the least of several edits is what is held.
        before = min(pair[column] for pair in sizes[begin : begin + _SPAN])
        after = min(pair[column] for pair in sizes[-_SPAN:])
        grown = after / max(before, 1e-9) - 1.0
        rows.append(
            {
                "what": f"{name}, {count:,} edits",
                "MB warm": before,
                "MB at the end": after,
                "growth": grown,
                "gate": GROWTH,
                "passed": grown < GROWTH,
            }
        )
    return rows


def own_memory_mb(pid: int | None) -> float:
    """Memory that a process has for itself, files it looks into left out, in MB; None is this one.

    Where the system does not tell, all that this process holds, and 0 for others.
    """
    try:
        lines = Path(f"/proc/{pid or 'self'}/status").read_text().splitlines()
        return sum(int(line.split()[1]) for line in lines if line.startswith(("RssAnon:", "RssShmem:"))) / 1e3
    except (OSError, ValueError, IndexError):
        return resident_memory_mb() if pid is None else 0.0
