"""A car that the arbiter brakes: decisions at 10 Hz, the receiver and the car at 20 Hz, measurements as they are."""

from collections.abc import Callable
from typing import NamedTuple

import msgspec

from domain.kinematics import GRAVITY_MPS2
from proto.decision import ArbitrationRequest, BrakeCommand, DecisionKind
from proto.perception import Track
from services.arbiter.assessment.reading import Pedals
from services.arbiter.braking.act import Permission
from services.arbiter.decide import Inputs, decide
from services.arbiter.state import ArbiterState, fresh
from services.simulator.car.brake_receiver import Brake, Controls
from tests.unit.services.arbiter.support import CALIBRATED, HANDS_OFF, SECOND, fused, mirror, request, track

STEP_S, STEPS = 0.05, 2
"""Of the car, and how many of them a decision."""
EMERGENCY = Permission(grant_id="g-2", max_deceleration_mps2=6.5, max_duration_s=20.0, refused="", envelope="emergency")
START_NS = 10**15


class Moment(NamedTuple):
    """A decision, and the car at it."""

    kind: DecisionKind
    withheld: str
    hazard: str
    command: BrakeCommand | None
    speed_mps: float
    gap_m: float
    applied_mps2: float
    state: ArbiterState


class Asked(NamedTuple):
    """What a tick asks: None instead of it is a tick without a decision."""

    request: ArbitrationRequest
    inputs: Inputs


Change = Callable[[int, Asked], Asked | None]


def as_is(tick: int, asked: Asked) -> Asked | None:
    """A tick as it comes."""
    return asked


def drive(
    speed_mps: float,
    gap_m: float,
    *,
    lead_mps: float = 0.0,
    lead_mps2: float = 0.0,
    mu: float = 0.8,
    mu_bounds: tuple[float, float] = (0.72, 0.98),
    effect: float = 1.0,
    permission: Permission = EMERGENCY,
    feet: Callable[[int], Pedals] = lambda tick: HANDS_OFF,
    change: Change = as_is,
    ticks: int = 150,
    kind: str = "vehicle",
) -> list[Moment]:
    """Approach a road user, which brakes with `lead_mps2` to a halt.

    `mu` and `effect` (share of the brakes) are the truth, `feet` the driver's by tick.
    """
    state, brake, speed, gap, found = fresh(CALIBRATED), Brake(), speed_mps, gap_m, list[Moment]()
    for tick in range(ticks):
        now_ns = START_NS + tick * SECOND // 10
        asked = _asked(tick, now_ns, speed, gap, lead_mps, mu_bounds, effect, kind, feet(tick), state, permission)
        if lead_mps2 > 0.0 and lead_mps > 0.0:
            asked = _with_braking(asked, -lead_mps2)
        changed = change(tick, asked)
        command, verdict = None, None
        if changed is not None:
            verdict = decide(changed.request, changed.inputs, CALIBRATED)
            state, command = verdict.state, verdict.command
        if command is not None:
            brake = brake.receive(command, now_ns)
        decision = verdict.decision if verdict is not None else None
        found.append(
            Moment(
                decision.kind if decision is not None else "SILENT",
                decision.act_withheld if decision is not None else "",
                decision.hazard if decision is not None else "",
                command,
                speed,
                gap,
                brake.applied_mps2,
                state,
            )
        )
        for step in range(STEPS):
            pedals = feet(tick)
            controls = Controls(accelerator=pedals.accelerator or 0.0, brake=pedals.brake or 0.0)
            brake = brake.step(now_ns + step * 50_000_000, STEP_S, controls, speed)
            asked_mps2 = max(min(8.3, brake.applied_mps2 / effect), 8.0 * (pedals.brake or 0.0))
            given = min(asked_mps2, mu * GRAVITY_MPS2) * effect
            before, speed = speed, max(0.0, speed - given * STEP_S)
            gap -= ((before + speed) / 2.0 - lead_mps) * STEP_S
            lead_mps = max(0.0, lead_mps - lead_mps2 * STEP_S)
    return found


def _asked(
    tick: int, now_ns: int, speed: float, gap: float, lead_mps: float, mu_bounds: tuple[float, float], effect: float,
    kind: str, pedals: Pedals, state: ArbiterState, permission: Permission,
) -> Asked:  # fmt: skip
    closing = speed - lead_mps
    body = {"length_m": 0.5} if kind == "pedestrian" else {}
    seen = track(gap_m=gap - (2.0 if kind == "pedestrian" else 0.0), closing_mps=closing, kind=kind, **body)
    near = closing > 0.1 and gap / closing < 2.8
    asked = request(
        seen if kind == "vehicle" else None,
        pedestrian=seen if kind == "pedestrian" else None,
        tick=tick, stamp_ns=now_ns, ego_speed_mps=speed, brake_envelope=effect, mu_low=mu_bounds[0], mu_high=mu_bounds[1],
        fused=fused(hazard={"vehicle": "closing_lead"}.get(kind, "pedestrian") if near else "", urgency="alarm" if near else "advice"),
    )  # fmt: skip
    inputs = mirror(asked, now_ns=now_ns, state=state, permission=permission)
    reading = msgspec.structs.replace(inputs.reading, pedals=pedals)
    return Asked(asked, msgspec.structs.replace(inputs, reading=reading))


def _with_braking(asked: Asked, ax_mps2: float) -> Asked:
    """The road user braking over ground, in both views."""

    def moved(track: Track) -> Track:
        return msgspec.structs.replace(track, ax_mps2=ax_mps2)

    reading = asked.inputs.reading
    view = msgspec.structs.replace(reading.view, actors=tuple(moved(each) for each in reading.view.actors))
    lead = asked.request.lead
    return Asked(
        msgspec.structs.replace(asked.request, lead=moved(lead) if lead is not None else None),
        msgspec.structs.replace(asked.inputs, reading=msgspec.structs.replace(reading, view=view)),
    )


def impact_mps(moments: list[Moment]) -> float:
    """The closing speed at contact (of a road user that stands); 0: no contact."""
    return next((each.speed_mps for each in moments if each.gap_m <= 0.0), 0.0)


def braked(moments: list[Moment]) -> list[bool]:
    """Whether a command goes out, tick by tick."""
    return [each.command is not None for each in moments]
