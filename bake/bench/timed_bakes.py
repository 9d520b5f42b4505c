"""A process that bakes one scene with several options and tells how long each took: `python -m bake.bench.timed_bakes`.

It reads `{"scene": …, "jobs": [[result folder, options], …]}` and answers with the seconds of each job. Libraries and
kernels are loaded by a bake of a lone cube first, as other bakers' interpreters load theirs before they look at the
clock.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bake.bench.synthetic import cube, write_ply
from bake.pipeline import BakeRequest, run_bake


def main() -> None:
    """Answers one request on standard input."""
    request = json.load(sys.stdin)
    jobs: list[tuple[str, Mapping[str, Any]]] = request["jobs"]
    with tempfile.TemporaryDirectory(prefix="obscura-warm-") as folder:
        lone = Path(folder) / "cube.ply"
        write_ply(lone, cube())
        for number, (_, options) in enumerate(jobs):
            _seconds(lone, Path(folder) / str(number), options)
    seconds = [_seconds(Path(request["scene"]), Path(result), options) for result, options in jobs]
    json.dump(seconds, sys.stdout)


def _seconds(scene: Path, result: Path, options: Mapping[str, Any]) -> float:
    run = run_bake(BakeRequest(scene, result, options))
    while True:
        try:
            next(run)
        except StopIteration as ended:
            return float(ended.value.seconds)


if __name__ == "__main__":
    main()
