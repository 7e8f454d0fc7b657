"""`python -m studies tracking.crossings`: how soon a road user that crosses is seen to come into the ego's path.

Cars with right of way at junctions, or (`--who people`) people who step out before the ego. Each is driven up to from a
little before, without advice.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

import msgspec

from drivemcp.errors import UserError
from drivemcp.paths import data
from evaluation.scenarios.generate import generate
from evaluation.scenarios.names import Place, read_place
from evaluation.tables.columns import Column
from proto.perception import Track
from proto.truth import TrueActor
from services.orchestrator.world.actors import crosses, well_seen
from services.perception.detect.detector import Detector
from services.perception.detect.loading import load_detector
from services.simulator.render import RendererUnavailable
from services.simulator.scenario.plan import Scenario
from studies.output import Cell, Sheet, add_json, show
from studies.tracking.recording import Step, drive_of, kept
from studies.tracking.seeing import View, glances, views

BEFORE_M, SPEED_KMH = 115.0, 45.0
"""Where a drive begins before the place, and how fast it begins."""
NEAR_SHARE = 0.1
"""A track so much of its distance from an actor, and a few metres, may be of it."""
IN_TIME_S = 0.5
PLACES = (
    *(f"urb-rain/development/{number}" for number in range(8)),
    *(f"cross-border/development/{number}" for number in range(8)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Who:
    """A kind of road user that crosses, and what counts as seeing it."""

    hazard: str
    """As truth calls it."""
    seconds: float
    """How long a drive up to one lasts."""
    near_m: float
    places: Callable[[Scenario], Iterator[float]]
    """Where in a plan they cross."""
    comes: Callable[[Track], bool]
    """Whether a track is in the path, or said to come into it."""
    seems: Callable[[Track], bool]
    """Whether it is one that moves across into the path."""
    moves_mps: float
    """A road user that is slower across does not cross."""


def _walks_in(track: Track) -> bool:
    """Whether a person would be told of: in the path, or on the way into it."""
    return track.kind == "pedestrian" and well_seen(track) and crosses(track)


CARS = Who(
    hazard="priority",
    seconds=16.0,
    near_m=6.0,
    places=lambda plan: (line.at_m for line in plan.yields if line.cars),
    comes=lambda track: track.in_ego_path,
    seems=lambda track: track.kind == "vehicle" and track.in_ego_path and abs(track.vy_mps) > 2.0,
    moves_mps=1.0,
)
PEOPLE = Who(
    hazard="pedestrian",
    seconds=10.0,
    near_m=2.0,
    places=lambda plan: (each.at_m for each in plan.crossers if each.when_ego_within_m is not None),
    comes=_walks_in,
    seems=lambda track: _walks_in(track) and not track.in_ego_path,
    moves_mps=0.3,
)
WHO = {"cars": CARS, "people": PEOPLE}


class Crossing(msgspec.Struct, frozen=True, kw_only=True):
    """A road user that crosses. `late_s`: from the hazard's onset to the first track that tells of it; `None`: never."""

    place: str
    onset_s: float
    late_s: float | None
    false: int
    """Tracks that seem to cross and are of no road user that does."""


def approaches(place: Place, who: Who = CARS) -> Iterator[tuple[str, Scenario]]:
    """The place's plans, begun anew before each road user that crosses; each has a name of its own."""
    plan = generate(place.family, place.number, place.split)
    for number, at_m in enumerate(who.places(plan)):
        ego = msgspec.structs.replace(plan.ego, at_m=max(0.0, at_m - BEFORE_M), speed_kmh=SPEED_KMH)
        yield f"{place} {number}", msgspec.structs.replace(plan, ego=ego)


def judged(name: str, steps: Sequence[Step], seen: Sequence[View], who: Who = CARS) -> Crossing | None:
    """What became of the drive's first such hazard; None: the drive had no such hazard."""
    hazards = [(step.truth.time_s, each) for step in steps for each in step.truth.hazards if each.kind == who.hazard]
    if not hazards:
        return None
    onset_s, hazard = hazards[0]
    since = (view for view in seen if view.truth.time_s >= onset_s)
    told_s = next((view.truth.time_s for view in since if _told(view, hazard.actor_id, who)), None)
    false = {track.track_id for view in seen for track in view.tracks.tracks if _false(track, view, who)}
    late_s = None if told_s is None else told_s - onset_s
    return Crossing(place=name, onset_s=onset_s, late_s=late_s, false=len(false))


def _told(view: View, actor_id: int | None, who: Who) -> bool:
    own = next((actor for actor in view.truth.actors if actor.actor_id == actor_id), None)
    return own is not None and any(who.comes(track) and _near(track, own, who) for track in view.tracks.tracks)


def _false(track: Track, view: View, who: Who) -> bool:
    moving = (each for each in view.truth.actors if abs(each.vy_mps) > who.moves_mps)
    return who.seems(track) and not any(_near(track, each, who) for each in moving)


def _near(track: Track, actor: TrueActor, who: Who) -> bool:
    return math.hypot(track.x_m - actor.x_m, track.y_m - actor.y_m) < who.near_m + NEAR_SHARE * abs(actor.x_m)


def sheet(found: Sequence[Crossing]) -> Sheet:
    """A row a crossing, and what they come to."""
    rows: list[tuple[Cell, ...]] = [
        (each.place, each.onset_s, "never" if each.late_s is None else each.late_s, each.false) for each in found
    ]
    late = [math.inf if each.late_s is None else each.late_s for each in found]
    in_time, false = sum(each <= IN_TIME_S for each in late), sum(each.false for each in found)
    rows.append((f"{len(found)}: median", "", f"{median(late):.2f}; {in_time} within {IN_TIME_S}", false))
    columns = (
        "who crosses",
        Column(title="onset", unit="s"),
        Column(title="seen to come after", unit="s"),
        "falsely crossing",
    )
    return Sheet(columns, rows)


def main() -> int:
    """Measure and print; 2 where something is missing."""
    parser = argparse.ArgumentParser(prog="python -m studies tracking.crossings", description=__doc__)
    parser.add_argument("--place", nargs="+", default=PLACES, metavar="FAMILY/SPLIT/NUMBER")
    parser.add_argument("--who", choices=tuple(WHO), default="cars")
    parser.add_argument(
        "--keep", type=Path, default=None, help="a folder for the drives, so that they are rendered once"
    )
    add_json(parser)
    flags = parser.parse_args()
    try:
        detector = load_detector(data("models/detector.onnx"))
        found = [each for name in flags.place for each in _measured(name, WHO[flags.who], detector, flags.keep)]
    except (UserError, RendererUnavailable) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    show([sheet(found) if found else Sheet((), (), ["no person came in sight"])], as_json=flags.json)
    return 0


def _measured(name: str, who: Who, detector: Detector, keep: Path | None) -> Iterator[Crossing]:
    place = read_place(name)
    if place is None:
        raise UserError(f"no place {name!r}: family/split/number, e.g. urb-rain/development/3")
    for title, plan in approaches(place, who):
        file = f"{title} {who.hazard}" if who is PEOPLE else title
        path = keep / f"{file.replace('/', '-').replace(' ', '-')}.msgpack" if keep is not None else None
        sys.stderr.write(f"{title}\n")
        steps = kept(path, partial(drive_of, plan, 1, who.seconds))
        crossing = judged(title, steps, views(glances(steps, detector)), who)
        if crossing is not None:
            yield crossing


if __name__ == "__main__":
    raise SystemExit(main())
