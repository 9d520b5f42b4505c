"""Fixtures for tests of stored results and exports."""

from __future__ import annotations

import pytest
from synthetic_results import build_result

from bake.types import BakeResult


@pytest.fixture
def result() -> BakeResult:
    """A result of three small objects."""
    return build_result()
