"""One run of the table: driven with an absent driver and a grant for emergencies, and what came of it."""

import math
import tempfile
from bisect import bisect_right
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from domain.kinematics import GRAVITY_MPS2
from drivemcp.node import Node
from drivemcp.service import Service
from evaluation.campaign.replacing import write_whole
from evaluation.guard.beside import BESIDE, governed
from evaluation.guard.scenes import SCENES, Ground, scenario
from evaluation.run.grant import EMERGENCY, granted
from evaluation.run.host import drive
from evaluation.run.ready import RunError
from evaluation.run.spec import RunSpec
from proto import topics
from proto.decision import Advisory, BrakeCommand, Decision
from proto.perception import Track
from proto.truth import Truth
from services.arbiter.assessment.assess import gap_m
from services.arbiter.braking.guard import undoubted
from services.arbiter.profiles.profile import Profile, load
from services.simulator.car.brake_receiver import MAX_JERK_MPS3
from services.simulator.car.braking import FULL_MPS2

GUARD = "guard/"
"""How the cells' names begin."""
DELAY_S = 0.2
"""From a picture to the brakes."""


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What came of a run; speeds in km/h, None where nothing of the kind was."""

    impact_kmh: float
    """Closing speed at contact; 0: no contact."""
    physics_kmh: float
    """The least closing speed at contact, braked as hard as road and brakes give from the first sure sight on."""
    braked: bool
    """Whether any command to brake went out."""
    warned_s: float | None = None
    """From the first warning to the first command."""
    demanded_mps2: float = 0.0
    """The hardest command."""
    warnings: int = 0


class Told(NamedTuple):
    """All that a run published that the table needs, each by its stamp (ns)."""

    truths: list[tuple[int, Truth]]
    decisions: list[tuple[int, Decision]]
    advisories: list[tuple[int, Advisory]]
    commands: list[tuple[int, BrakeCommand]]


def place_of(scene: str, speed_kmh: int, ground: Ground) -> str:
    """The cell as a run's scenario."""
    return f"{GUARD}{scene}/{speed_kmh}/{ground}"


def cell_of(place: str) -> tuple[str, int, Ground]:
    """Scene, speed (km/h) and ground of `place_of`."""
    _, scene, speed, ground = place.split("/")
    return scene, int(speed), ground  # type: ignore[return-value]


def run_cell(folder: str, key: str, spec: RunSpec) -> Outcome:
    """Drive one run of a cell, and keep its outcome as KEY.json in `folder`. Raises what `drive` raises."""
    with tempfile.TemporaryDirectory() as name:
        part = Path(name)
        told = Told([], [], [], [])
        drive(prepared(spec, part), part, _listen(told), _braked_by(spec.method))
    if not told.truths:
        raise RunError("the simulator told no truth")
    found = outcome(told)
    write_whole(Path(folder) / f"{key}.json", msgspec.json.encode(found))
    return found


def prepared(spec: RunSpec, folder: Path) -> RunSpec:
    """The run of a cell with its scenario and a grant for emergencies as files in `folder`."""
    scene, speed_kmh, ground = cell_of(spec.scenario)
    file = folder / f"{spec.scenario.replace('/', '-')}.json"
    file.write_bytes(msgspec.json.encode(scenario(SCENES[scene], speed_kmh, ground)))
    return granted(msgspec.structs.replace(spec, scenario=str(file)), folder, EMERGENCY)


def _braked_by(method: str) -> Callable[[Service[Any]], Service[Any]]:
    """The services as they are, or with the arbiter's commands replaced by those of a governor of that name."""
    return lambda service: governed(service, BESIDE[method]) if method in BESIDE else service


def _listen(told: Told) -> Any:
    def observe(node: Node) -> None:
        node.subscribe(topics.TRUTH, lambda message, info: told.truths.append((info.stamp_ns, message)))
        node.subscribe(topics.DECISION, lambda message, info: told.decisions.append((info.stamp_ns, message)))
        node.subscribe(topics.ADVISORY, lambda message, info: told.advisories.append((info.stamp_ns, message)))
        node.subscribe(topics.BRAKE, lambda message, info: told.commands.append((info.stamp_ns, message)))

    return observe


def outcome(told: Told) -> Outcome:
    """What came of what was told."""
    warnings = [stamp for stamp, each in told.advisories if each.kind != "SILENT" and each.hazard]
    first = told.commands[0][0] if told.commands else None
    return Outcome(
        impact_kmh=round(_impact_mps(told.truths) * 3.6, 1),
        physics_kmh=round(_physics_mps(told) * 3.6, 1),
        braked=first is not None,
        warned_s=(first - warnings[0]) / 1e9 if first is not None and warnings and warnings[0] <= first else None,
        demanded_mps2=max((each.deceleration_mps2 for _, each in told.commands), default=0.0),
        warnings=len(warnings),
    )


def _impact_mps(truths: list[tuple[int, Truth]]) -> float:
    at = next((at for at, (_, truth) in enumerate(truths) if truth.collision), None)
    return _closing_mps(truths[max(0, at - 1)][1]) if at is not None else 0.0


def _closing_mps(truth: Truth) -> float:
    """The ego's closing speed: on the vehicle ahead; without one, on what stands or walks across."""
    return truth.speed_mps if truth.closing_mps is None else max(0.0, truth.closing_mps)


def _physics_mps(told: Told) -> float:
    """Closing speed at contact, braked from the first instant at which the arbiter's own reading held an undoubted road user in the way."""
    stamps, profile = [stamp for stamp, _ in told.truths], load("calibrated")
    for stamp, decision in told.decisions:
        seen = _undoubted(decision, profile)
        if seen is None:
            continue
        truth = told.truths[max(0, bisect_right(stamps, stamp) - 1)][1]
        can = min(truth.mu * GRAVITY_MPS2, FULL_MPS2) * truth.brake_share
        closing = -seen.vx_mps
        left = gap_m(seen, profile) - closing * (DELAY_S + can / (2.0 * MAX_JERK_MPS3))
        return math.sqrt(max(0.0, closing * closing - 2.0 * can * max(0.0, left)))
    return _impact_mps(told.truths)


def _undoubted(decision: Decision, profile: Profile) -> Track | None:
    actors = decision.own.get("reading", {}).get("view", {}).get("actors", ())
    tracks = [msgspec.convert(each, Track) for each in actors]
    closing = [each for each in tracks if undoubted(each, profile, gives_way=False) and each.vx_mps < 0.0]
    return min(closing, key=lambda each: each.x_m, default=None)
