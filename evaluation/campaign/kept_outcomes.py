"""Runs of which only the outcome is kept, a file KEY.json each: what is there is never driven again."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

import msgspec

from app.drive.screen import Screen
from drivemcp.errors import MALFORMED
from evaluation.campaign.pool import Job, Pool, Work
from evaluation.run.spec import RunSpec

T = TypeVar("T")


def kept(runs: Path, key: str, kind: type[T]) -> T | None:
    """A run's outcome; None: it is not there, or damaged."""
    try:
        return msgspec.json.decode((runs / f"{key}.json").read_bytes(), type=kind)
    except (OSError, *MALFORMED):
        return None


def drive_missing(
    specs: Mapping[str, RunSpec], runs: Path, jobs: int, screen: Screen, work: Work, named: Callable[[RunSpec], str]
) -> None:
    """Drive the runs whose outcome is not in the folder `runs`; one that fails is told by its name."""
    waiting = [Job(key, spec) for key, spec in specs.items() if kept(runs, key, object) is None]
    screen.say(f"{len(specs)} runs, {len(specs) - len(waiting)} of them are there; in {runs}")
    began_s = time.monotonic()
    for count, done in enumerate(Pool(str(runs.resolve()), jobs, work).done(waiting), 1):
        name = named(specs[done.key])
        if done.problem:
            screen.say(f"{name} failed: {done.problem.strip().splitlines()[-1]}")
        left_s = (time.monotonic() - began_s) / count * (len(waiting) - count)
        screen.live(f"{count} of {len(waiting)} runs; about {left_s / 60:.1f} min left; last: {name}")
    screen.end_live()
