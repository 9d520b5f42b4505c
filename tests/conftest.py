"""What all tests share: properties are judged by their results, never by their time; logs are left as they were."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("obscura", deadline=None)
settings.load_profile("obscura")


@pytest.fixture(autouse=True)
def log_left_alone() -> Iterator[None]:
    """A command run in the test's own process sets up a log on a stream that ends with the test."""
    loggers = [logging.getLogger(name) for name in (None, "app", "bake", "viewer")]
    levels = [logger.level for logger in loggers]
    handlers = list(loggers[0].handlers)
    yield
    loggers[0].handlers[:] = handlers
    for logger, level in zip(loggers, levels, strict=True):
        logger.setLevel(level)
