"""One start of the program, timed from within: `python -m app.window_bench.start RESULT FOLDER BEGIN`.

It leaves a JSON object in FOLDER: seconds since BEGIN, which is a Unix time, to the first picture of the window and to
the first with the result's values on the surface, and how many of these were drawing.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

TIMES_FILE = "start.json"


def main() -> int:
    """Opens the window as the program does, with habits of its own, and closes it after the first picture."""
    begin = float(sys.argv[3])
    import pyvistaqt  # noqa: F401 - before all else of the window
    from PyQt6.QtCore import QSettings, QTimer

    import app.cli  # noqa: F401 - as main.py does
    from app.style import application
    from app.window import Window
    from app.window_bench.drawing import DrawingClock

    loaded = time.time() - begin
    result, folder = Path(sys.argv[1]), Path(sys.argv[2])
    application_, clock = application(), DrawingClock()
    window = Window(folder / "cache", QSettings(str(folder / "habits.ini"), QSettings.Format.IniFormat))
    clock.follow(window.area.main.view)
    row: dict[str, float] = {"imports": loaded}

    def on_picture() -> None:
        seconds = time.time() - begin
        row.setdefault("window", seconds)
        row.setdefault("window drawing", clock.seconds)
        if window.area.main.surface is not None and "geometry" not in row:
            row.update({"geometry": seconds, "geometry drawing": clock.seconds})
        if window.document.shown() is not None and "picture" not in row:
            row.update({"picture": seconds, "drawing": clock.seconds})
            QTimer.singleShot(0, window.close)

    clock.shown.connect(on_picture)
    window.show()
    window.controller.open(result)
    application_.exec()
    (folder / TIMES_FILE).write_text(json.dumps(row))
    return 0


if __name__ == "__main__":
    sys.exit(main())
