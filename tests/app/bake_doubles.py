"""Bakes that misbehave in known ways, to test the engine around them; run inside its process."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Generator
from dataclasses import dataclass

from app.engine_protocol import BakeJob
from bake.errors import SettingsError
from bake.types import Progress


@dataclass(frozen=True)
class Outcome:
    """What a bake double ends with."""

    unchanged: bool = False
    seconds: float = 0.5


def counting(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Reports two stages with many steps, quickly."""
    for stage in ("load", "trace"):
        for done in range(500):
            yield Progress(stage, done, 500)
    return Outcome()


def endless(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Never ends, but can be stopped between its steps."""
    while True:
        time.sleep(0.01)
        yield Progress("trace", 1, 2)


def hanging(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Hangs where no flag is looked at, as a device can, and says so before; a job with seed 2 ends at once."""
    yield Progress("trace", 0, 2)
    if job.options["seed"] != 2:
        logging.getLogger(__name__).info("hanging")
        time.sleep(600.0)
    return Outcome()


def refusing(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Ends in an error that the user can mend."""
    yield Progress("load", 0, 0)
    raise SettingsError("7 is below 8", where="--rays", remedy="use 8 to 64")


def defective(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Has a defect."""
    yield Progress("load", 0, 0)
    raise ZeroDivisionError("division by zero")


def dying(job: BakeJob) -> Generator[Progress, None, Outcome]:
    """Takes its process down, as a device fault does."""
    yield Progress("trace", 0, 2)
    os._exit(3)
