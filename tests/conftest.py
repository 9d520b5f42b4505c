"""What all tests share: properties are judged by their results, never by their time."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("obscura", deadline=None)
settings.load_profile("obscura")
