"""A process that bakes one scene twice and tells what starting cost: `python -m bake.bench.scaling_first`.

It reads `{"scene": …, "folder": …, "options": …}` and answers with seconds. Everything heavy is imported inside, so
that the imports are timed too.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path


def main() -> None:
    """Answers one request on standard input."""
    request = json.load(sys.stdin)
    folder, times = Path(request["folder"]), [time.perf_counter()]

    from bake.devices import initialised_warp
    from bake.pipeline import BakeRequest, run_bake

    times.append(time.perf_counter())
    initialised_warp()
    times.append(time.perf_counter())
    for number in range(2):
        for _ in run_bake(BakeRequest(Path(request["scene"]), folder / str(number), request["options"])):
            pass
        times.append(time.perf_counter())
    keys = ("imports s", "Warp s", "first bake s", "second bake s")
    json.dump({key: b - a for key, a, b in zip(keys, times[:-1], times[1:], strict=True)}, sys.stdout)


if __name__ == "__main__":
    main()
