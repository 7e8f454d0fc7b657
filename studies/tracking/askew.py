"""`python -m studies tracking.askew LOG...`: how far aside of where they are vehicles in bends are told to be.

A LOG is that of a lockstep run, the truth of its evaluation beside it.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice, pairwise
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from drivemcp.errors import UserError
from evaluation.metrics import from_log
from evaluation.tables.columns import Column
from proto import topics
from proto.perception import Track, Tracks
from proto.truth import TrueActor, Truth
from services.logger.format.reader import messages
from studies.output import Cell, Sheet, add_json, show

SURE, NEAR_M, FAR_M, MOVING_MPS = 0.7, 8.0, 60.0, 2.0
"""Tracks as sure as this, and moving vehicles between these distances, are compared."""
SAME_M = 5.0
"""A track is of the nearest vehicle, if that is no farther from it."""
ASKEW_RAD = (0.0, 0.05, 0.15, 0.3, 0.5, 0.8)
EVERY = 5
"""Of pictures; those between tell much the same."""


class Told(NamedTuple):
    """One vehicle in one picture."""

    oncoming: bool
    askew_rad: float
    """Between its axis and ours, to either side."""
    aside_m: float
    """From where it is to where it is told to be, to either side."""
    along_m: float
    """The same, nearer or farther."""


def compared(tracks: Iterable[Track], truth: Truth) -> Iterator[Told]:
    """Each sure track with the vehicle that it is of."""
    vehicles = [actor for actor in truth.actors if actor.kind == "vehicle"]
    for track in tracks:
        if track.kind != "vehicle" or track.confidence < SURE or not NEAR_M < track.x_m < FAR_M:
            continue
        actor = min(vehicles, key=lambda each: _apart_m(each, track), default=None)
        if actor is None or _apart_m(actor, track) > SAME_M:
            continue
        ahead_mps = actor.vx_mps + truth.speed_mps
        if math.hypot(ahead_mps, actor.vy_mps) >= MOVING_MPS:
            askew_rad = abs(math.atan2(actor.vy_mps, abs(ahead_mps)))
            yield Told(ahead_mps < 0.0, askew_rad, abs(track.y_m - actor.y_m), abs(track.x_m - actor.x_m))


def _apart_m(actor: TrueActor, track: Track) -> float:
    return math.hypot(actor.x_m - track.x_m, actor.y_m - track.y_m)


def told_in(log: Path) -> Iterator[Told]:
    """Of a run's log. Raises UserError where the file is not a log or has no truth beside it."""
    record = from_log(log)
    if not record.truths or not record.advisories:
        raise UserError(f"{log} has no truth beside it: give the log of a run of `drivemcp evaluate`")
    first_ns = next(each.stamp_ns for each in messages(log) if each.name == topics.ADVISORY.name)
    start_ns = first_ns - round(record.advisories[0].time_s * 1e9)
    shown = (each for each in messages(log) if each.name == topics.TRACKS.name)
    for logged in islice(shown, 0, None, EVERY):
        truth = record.truth_at((logged.stamp_ns - start_ns) / 1e9)
        if truth is not None:
            yield from compared(msgspec.json.decode(logged.data, type=Tracks).tracks, truth)


def sheet(told: Sequence[Told]) -> Sheet:
    """A row for each way and each range of angles."""
    rows: list[tuple[Cell, ...]] = []
    for oncoming in (True, False):
        for low, high in pairwise(ASKEW_RAD):
            off = [each.aside_m for each in told if each.oncoming == oncoming and low <= each.askew_rad < high]
            quantiles = [float(each) for each in np.quantile(off, (0.5, 0.9))] if off else [None, None]
            rows.append(("oncoming" if oncoming else "our way", f"{low} to {high}", len(off), *quantiles))
    aside = (Column(title="aside, median", unit="m"), Column(title="nine in ten", unit="m"))
    return Sheet(("", "askew, rad", "vehicles in pictures", *aside), rows)


def main() -> int:
    """Measure and print; 2 where a log cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m studies tracking.askew", description=__doc__)
    parser.add_argument("log", nargs="+", type=Path)
    add_json(parser)
    flags = parser.parse_args()
    try:
        told = [each for log in flags.log for each in told_in(log)]
    except (UserError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    show([sheet(told)], as_json=flags.json)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
