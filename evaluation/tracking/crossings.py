"""`python -m evaluation.tracking.crossings`: how soon who has right of way and crosses is seen to come into the ego's path.

The junctions of generated places at which a car comes are driven up to, each from a little before, without advice.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from statistics import median

import msgspec

from drivemcp.errors import UserError
from drivemcp.paths import data
from evaluation.scenarios.generate import generate
from evaluation.scenarios.names import Place, read_place
from evaluation.tracking.recording import Step, drive_of, kept
from evaluation.tracking.seeing import View, glances, views
from proto.perception import Track
from proto.truth import TrueActor
from services.perception.detector import Detector
from services.perception.loading import load_detector
from services.simulator.plan import Scenario
from services.simulator.render import RendererUnavailable

BEFORE_M, SECONDS, SPEED_KMH = 115.0, 16.0, 45.0
"""Where a drive begins before the line, how long it lasts, and how fast it begins."""
NEAR_M, NEAR_SHARE = 6.0, 0.1
"""A track so near to an actor, and so much of its distance, may be of it."""
ACROSS_MPS = 2.0
IN_TIME_S = 0.5
PLACES = (
    *(f"urb-rain/development/{number}" for number in range(8)),
    *(f"cross-border/development/{number}" for number in range(8)),
)


class Crossing(msgspec.Struct, frozen=True, kw_only=True):
    """One car that crosses. `late_s`: from the hazard's onset to the first track of it in the path; None: never."""

    place: str
    onset_s: float
    late_s: float | None
    false: int
    """Tracks in the path that seem to cross and are of nobody who does."""


def approaches(place: Place) -> Iterator[tuple[str, Scenario]]:
    """The place's plans, begun anew before each junction at which a car comes; with a name of its own."""
    plan = generate(place.family, place.number, place.split)
    for number, line in enumerate(line for line in plan.yields if line.cars):
        ego = msgspec.structs.replace(plan.ego, at_m=max(0.0, line.at_m - BEFORE_M), speed_kmh=SPEED_KMH)
        yield f"{place} {number}", msgspec.structs.replace(plan, ego=ego)


def judged(name: str, steps: Sequence[Step], seen: Sequence[View]) -> Crossing | None:
    """What became of the drive's first hazard of priority; None: there is none, nobody came in sight."""
    hazards = [(step.truth.time_s, each) for step in steps for each in step.truth.hazards if each.kind == "priority"]
    if not hazards:
        return None
    onset_s, hazard = hazards[0]
    told_s = next((view.truth.time_s for view in seen if _told(view, hazard.actor_id)), None)
    false = {track.track_id for view in seen for track in view.tracks.tracks if _false(track, view)}
    late_s = None if told_s is None else max(0.0, told_s - onset_s)
    return Crossing(place=name, onset_s=onset_s, late_s=late_s, false=len(false))


def _told(view: View, actor_id: int | None) -> bool:
    own = next((actor for actor in view.truth.actors if actor.actor_id == actor_id), None)
    return own is not None and any(track.in_ego_path and _near(track, own) for track in view.tracks.tracks)


def _false(track: Track, view: View) -> bool:
    seems = track.kind == "vehicle" and track.in_ego_path and abs(track.vy_mps) > ACROSS_MPS
    return seems and not any(abs(each.vy_mps) > 1.0 and _near(track, each) for each in view.truth.actors)


def _near(track: Track, actor: TrueActor) -> bool:
    return math.hypot(track.x_m - actor.x_m, track.y_m - actor.y_m) < NEAR_M + NEAR_SHARE * abs(actor.x_m)


def table(found: Sequence[Crossing]) -> str:
    """A row a crossing, and what they come to."""
    lines = ["| junction | onset, s | in the path after, s | falsely crossing |", "| --- | --- | --- | --- |"]
    lines += [
        f"| {c.place} | {c.onset_s:.2f} | {'never' if c.late_s is None else f'{c.late_s:.2f}'} | {c.false} |"
        for c in found
    ]
    late = [math.inf if each.late_s is None else each.late_s for each in found]
    in_time = sum(each <= IN_TIME_S for each in late)
    lines.append(
        f"| {len(found)}: median | | {median(late):.2f}; {in_time} within {IN_TIME_S} | {sum(each.false for each in found)} |"
    )
    return "\n".join(lines)


def main() -> int:
    """Measure and print; 2 where something is missing."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.tracking.crossings", description=__doc__)
    parser.add_argument("--place", nargs="+", default=PLACES, metavar="FAMILY/SPLIT/NUMBER")
    parser.add_argument(
        "--keep", type=Path, default=None, help="a folder for the drives, so that they are rendered once"
    )
    flags = parser.parse_args()
    try:
        detector = load_detector(data("models/detector.onnx"))
        found = [each for name in flags.place for each in _measured(name, detector, flags.keep)]
    except (UserError, RendererUnavailable) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write((table(found) if found else "nobody came in sight") + "\n")
    return 0


def _measured(name: str, detector: Detector, keep: Path | None) -> Iterator[Crossing]:
    place = read_place(name)
    if place is None:
        raise UserError(f"no place {name!r}: family/split/number, e.g. urb-rain/development/3")
    for title, plan in approaches(place):
        path = keep / f"{title.replace('/', '-').replace(' ', '-')}.msgpack" if keep is not None else None
        sys.stderr.write(f"{title}\n")
        steps = kept(path, partial(drive_of, plan, 1, SECONDS))
        crossing = judged(title, steps, views(glances(steps, detector)))
        if crossing is not None:
            yield crossing


if __name__ == "__main__":
    raise SystemExit(main())
