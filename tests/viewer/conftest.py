"""Fixtures for tests of what is seen."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_level import bake_level, write_level

from bake.results import load_result
from bake.types import BakeResult


@pytest.fixture(scope="session")
def baked(tmp_path_factory: pytest.TempPathFactory) -> BakeResult:
    """The small level, baked for real and read back from disk."""
    folder: Path = tmp_path_factory.mktemp("small-level")
    return load_result(bake_level(write_level(folder), folder / "result"))
