"""One run with a driver of a population and the grant for emergencies, and what came of it."""

import math
import tempfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import msgspec

from domain.hearing import ACT_PAUSE_S
from drivemcp.node import Node
from evaluation.campaign.replacing import write_whole
from evaluation.metrics.conflicts import EGO_LENGTH_M, EGO_WIDTH_M
from evaluation.metrics.spans import spans
from evaluation.population.windows import Window, scenario_of
from evaluation.run.grant import EMERGENCY, granted
from evaluation.run.host import drive
from evaluation.run.ready import RunError
from evaluation.run.spec import RunSpec
from evaluation.scenarios import read_place
from proto import topics
from proto.truth import TrueActor, Truth
from services.simulator.lockstep import EPOCH_NS

_WINDOW = "population/"


class Contact(msgspec.Struct, frozen=True, kw_only=True):
    """The car hit a road user, or a road user hit the car."""

    time_s: float
    kmh: float
    """Speed relative to the car, at the step before."""
    behind: bool
    """Whether a road user drove into the car from behind."""


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What came of a run."""

    km: float
    contacts: tuple[Contact, ...] = ()
    interventions: tuple[float, ...] = ()
    """When each began (s)."""


def name_of(window: Window) -> str:
    """The window as a run's scenario."""
    return f"{_WINDOW}{window.place}/{window.hazard}"


def window_of(name: str) -> Window | None:
    """The window of `name_of`; None: the name is that of a whole route."""
    if not name.startswith(_WINDOW):
        return None
    route, _, hazard = name.removeprefix(_WINDOW).rpartition("/")
    place = read_place(route)
    assert place is not None
    return Window(place, int(hazard))


def run_driver(folder: str, key: str, spec: RunSpec) -> Outcome:
    """Drive one run, and keep its outcome as KEY.json in `folder`. Raises what `drive` raises."""
    window = window_of(spec.scenario)
    truths: list[Truth] = []
    commands: list[float] = []
    with tempfile.TemporaryDirectory() as name:
        part, driven = Path(name), spec
        if window is not None:
            (file := part / f"{window}.json").write_bytes(msgspec.json.encode(scenario_of(window)))
            driven = msgspec.structs.replace(spec, scenario=str(file))
        drive(granted(driven, part, EMERGENCY), part, _listen(truths, commands))
    if not truths:
        raise RunError("the simulator told no truth")
    found = outcome(truths, commands)
    write_whole(Path(folder) / f"{key}.json", msgspec.json.encode(found))
    return found


def _listen(truths: list[Truth], commands: list[float]) -> Callable[[Node], None]:
    def observe(node: Node) -> None:
        node.subscribe(topics.TRUTH, lambda message, _: truths.append(message))
        node.subscribe(topics.BRAKE, lambda _, info: commands.append((info.stamp_ns - EPOCH_NS) / 1e9))

    return observe


def outcome(truths: list[Truth], commands: list[float]) -> Outcome:
    """What came of what was told."""
    return Outcome(
        km=truths[-1].distance_m / 1000.0,
        contacts=tuple(_contact(*pair) for pair in pairwise(truths) if _begins(*pair)),
        interventions=tuple(span.from_s for span in spans(((each, True) for each in commands), ACT_PAUSE_S)),
    )


def _begins(before: Truth, now: Truth) -> bool:
    return now.collision and not before.collision


def _contact(before: Truth, now: Truth) -> Contact:
    hit = min(before.actors, key=_distance_m, default=None)
    mps = before.speed_mps if hit is None else math.hypot(hit.vx_mps, hit.vy_mps)
    behind = hit is not None and hit.x_m < 0.0 and _across_m(hit) < 0.0
    return Contact(time_s=now.time_s, kmh=round(mps * 3.6, 1), behind=behind)


def _distance_m(actor: TrueActor) -> float:
    """Between the boxes of actor and car, both along the car."""
    return max(abs(actor.x_m) - (actor.length_m + EGO_LENGTH_M) / 2.0, _across_m(actor))


def _across_m(actor: TrueActor) -> float:
    """Below 0: it is before the car, or behind it, and not beside."""
    return abs(actor.y_m) - (actor.width_m + EGO_WIDTH_M) / 2.0
