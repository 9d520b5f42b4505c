"""A process that bakes one scene with several options and tells how long each took: `python -m bake.bench.timed_bakes`.

It reads `{"scene": …, "jobs": [[result folder, options], …]}` and answers with the seconds of each job, a line each as
they come. Libraries and kernels are loaded by a bake of a lone cube first, as other bakers' interpreters load theirs
before they look at the clock. A short bake is made three times, each into a folder of its own, and the median counts.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bake.bench.synthetic import cube, write_ply
from bake.errors import DeviceError
from bake.pipeline import BakeRequest, run_bake

SHORT = 5.0
"""Seconds; what takes less is timed three times."""


def bakes_timed(scene: Path, jobs: Sequence[tuple[str, Mapping[str, Any]]]) -> Iterator[float]:
    """The seconds of each job, result folder and options, as they come from a process of their own.

    Raises:
        DeviceError: the process failed.
    """
    # One process for all, as peers' interpreters load their libraries before they look at the clock.
    with tempfile.TemporaryFile("w+", prefix="obscura-timed-bakes-") as log:
        with subprocess.Popen(
            [sys.executable, "-m", "bake.bench.timed_bakes"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        ) as timed:
            assert timed.stdin is not None and timed.stdout is not None
            timed.stdin.write(json.dumps({"scene": str(scene), "jobs": jobs}))
            timed.stdin.close()
            for line in timed.stdout:
                yield float(line)
        if timed.returncode:
            log.seek(0)
            raise DeviceError("the timed bakes failed", where="bench", remedy=log.read().strip()[-400:])


def main() -> None:
    """Answers one request on standard input."""
    request = json.load(sys.stdin)
    jobs: list[tuple[str, Mapping[str, Any]]] = request["jobs"]
    with tempfile.TemporaryDirectory(prefix="obscura-warm-") as folder:
        lone = Path(folder) / "cube.ply"
        write_ply(lone, cube())
        for number, (_, options) in enumerate(jobs):
            _seconds(lone, Path(folder) / str(number), options)
    for result, options in jobs:
        taken = [_seconds(Path(request["scene"]), Path(result), options)]
        if taken[0] < SHORT:
            taken += [_seconds(Path(request["scene"]), Path(f"{result}-{again}"), options) for again in (2, 3)]
        sys.stdout.write(f"{statistics.median(taken)!r}\n")
        sys.stdout.flush()


def _seconds(scene: Path, result: Path, options: Mapping[str, Any]) -> float:
    run = run_bake(BakeRequest(scene, result, options))
    while True:
        try:
            next(run)
        except StopIteration as ended:
            return float(ended.value.seconds)


if __name__ == "__main__":
    main()
