"""The folder for results that the user did not save elsewhere."""

from __future__ import annotations

import os
from pathlib import Path

from PyQt6.QtCore import QStandardPaths


def cache_folder() -> Path:
    """Where the window keeps results that the user did not save elsewhere."""
    override = os.environ.get("OBSCURA_CACHE")
    if override:
        return Path(override)
    base = QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericCacheLocation)
    return Path(base) / "obscura"
