"""Defects of the window: logged and shown, instead of ending the program with the user's work."""

from __future__ import annotations

import logging
import sys
from collections.abc import Generator
from contextlib import contextmanager
from types import TracebackType

from app.banner import Banner

logger = logging.getLogger(__name__)


@contextmanager
def reported_defects(banner: Banner) -> Generator[None]:
    """While the block runs, an error that nobody caught is logged with its traceback and shown in a line."""

    def report(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, KeyboardInterrupt):
            former(kind, error, trace)
            return
        logger.error("defect in the window", exc_info=(kind, error, trace))
        try:
            banner.show_message(logging.ERROR, f"Defect in the window: {kind.__name__}: {error}. See the log.")
        except RuntimeError:
            logger.debug("the window is gone")

    former, sys.excepthook = sys.excepthook, report
    try:
        yield
    finally:
        sys.excepthook = former
