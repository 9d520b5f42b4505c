"""Rows of measurements with where they were taken, as JSON and as Markdown."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bake.pipeline import versions
from bake.settings import BakeSettings

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Measurements:
    """What one benchmark measured.

    Attributes:
        name: The benchmark's name.
        rows: One a measurement; units stand in the keys, `passed` says whether a gate held.
        notes: How it was measured, in sentences.
        seeds: What decides what is random, by name.
        settings: Bake options by long name, or those of each bake by its name.
    """

    name: str
    rows: Sequence[Row]
    notes: Sequence[str] = ()
    seeds: Mapping[str, int] = field(kw_only=True)
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any], kw_only=True)

    @property
    def passed(self) -> bool:
        """Whether every row with a gate passed it."""
        return all(row.get("passed", True) for row in self.rows)

    def to_json(self) -> dict[str, Any]:
        """One object: machine, versions, seeds, settings, notes and rows."""
        return {
            "bench": self.name,
            "machine": machine(),
            "versions": versions(),
            "seeds": dict(self.seeds),
            "settings": dict(self.settings),
            "notes": list(self.notes),
            "rows": [dict(row) for row in self.rows],
        }

    def to_markdown(self) -> str:
        """A table with one line a row, and the notes below."""
        if not self.rows:
            return "(no rows)"
        keys = list(dict.fromkeys(key for row in self.rows for key in row))
        lines = ["| " + " | ".join(keys) + " |", "|" + "---|" * len(keys)]
        lines += ["| " + " | ".join(_cell(row.get(key)) for key in keys) + " |" for row in self.rows]
        return "\n".join([*lines, "", *(f"- {note}" for note in self.notes)])


def bake_seed(options: Mapping[str, Any]) -> int:
    """The seed of bakes with these options, where no side file says another."""
    return int(options.get("seed", BakeSettings().seed))


def machine() -> dict[str, Any]:
    """Processor, cores and system of this machine."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        model = names[0] if names else model
    return {
        "processor": model,
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "**no**"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)
