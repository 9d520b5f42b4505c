"""Regions made from formulas, for walks."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "regions"))  # the synthetic regions live there
