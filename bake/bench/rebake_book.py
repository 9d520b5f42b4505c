"""What a run of random edits compared so far, kept on disk, so that a run that is cut off loses nothing."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from bake.results import load_result, save_result
from bake.settings import BakeSettings
from bake.types import BakeResult


class Book:
    """Rows on disk, one an edit, and the last result of a run that ended in good order.

    Args:
        folder: Where to keep them; nothing is kept if None.
        path: The scene.
        settings: Before the first edit: rows of other settings are thrown away.
        bound, seed: Of the run; each pair has files of its own.

    Attributes:
        rows: Those that are known.
    """

    def __init__(self, folder: Path | None, path: Path, settings: BakeSettings, *, bound: float, seed: int) -> None:
        self.rows: list[dict[str, Any]] = []
        self._file: Path | None = None
        if folder is None:
            return
        folder.mkdir(parents=True, exist_ok=True)
        self._file = folder / f"{path.stem}-{bound:g}-{seed}.jsonl"
        head = {"settings": settings.to_json()}
        lines = self._file.read_text().splitlines() if self._file.is_file() else []
        if lines and json.loads(lines[0]) == head:
            self.rows = [json.loads(line) for line in lines[1:] if line.endswith("}")]
        else:
            self._file.write_text(json.dumps(head) + "\n")
            for state in self._states():
                shutil.rmtree(state)

    def add(self, row: dict[str, Any]) -> None:
        """Writes a row down."""
        self.rows.append(row)
        if self._file is not None:
            with self._file.open("a") as file:
                file.write(json.dumps(row) + "\n")

    def state(self) -> tuple[int, BakeResult | None]:
        """After how many edits a run ended, and its result then; 0 and None if none is known."""
        for folder in self._states():
            done = int(folder.name.rpartition("-")[2])
            if done <= len(self.rows):
                return done, load_result(folder)
        return 0, None

    def put_state(self, done: int, result: BakeResult) -> None:
        """Keeps the result after some edits instead of an earlier one."""
        if self._file is None:
            return
        former = self._states()
        save_result(result, self._file.with_name(f"{self._file.stem}-after-{done}"))
        for folder in former:
            if not folder.name.endswith(f"-after-{done}"):
                shutil.rmtree(folder)

    def _states(self) -> list[Path]:
        if self._file is None:
            return []
        found = self._file.parent.glob(f"{self._file.stem}-after-*")
        return sorted(found, key=lambda folder: -int(folder.name.rpartition("-")[2]))
