"""Scripted approaches in which only the arbiter brakes: what too strict guards would cost, which few recorded drives can show.

The driver does nothing, the arbiter alone decides, on tracks as a settled tracker gives them; the car brakes as commanded.
"""

from typing import Literal, NamedTuple

from evaluation.metrics.conflicts import ttc_s
from proto.decision import ArbitrationRequest, Fused
from proto.perception import Track
from services.arbiter.assessment.assess import View
from services.arbiter.assessment.reading import Pedals, Reading
from services.arbiter.decide import Inputs, decide
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import ArbiterState, fresh
from studies.calibrate.again import GRANTED

TICK_NS, TICK_S = 100_000_000, 0.1
LONGEST_S = 15.0
EGO_M = LEAD_M = 4.5


class Approach(NamedTuple):
    """A road user that comes near, first seen at `gap_m`."""

    name: str
    ego_mps: float
    lead_mps: float
    gap_m: float
    lead_brakes_mps2: float = 0.0
    kind: Literal["vehicle", "pedestrian"] = "vehicle"
    confidence: float = 0.92


APPROACHES = (
    Approach("a car stands, town", 10.0, 0.0, 50.0),
    Approach("a car stands, 50 km/h", 14.0, 0.0, 60.0),
    Approach("a car stands, country road", 22.0, 0.0, 70.0),
    Approach("a lead brakes, 1 s behind", 15.0, 15.0, 15.0, 6.0),
    Approach("a lead brakes, 1.5 s behind", 25.0, 25.0, 37.0, 6.0),
    Approach("a slower one cuts in", 28.0, 20.0, 14.0),
    Approach("one cuts in and brakes", 25.0, 22.0, 14.0, 3.0),
    Approach("somebody steps out", 11.0, 0.0, 18.0, 0.0, "pedestrian"),
    Approach("somebody steps out, 30 zone", 8.0, 0.0, 12.0, 0.0, "pedestrian"),
)
"""Ours: the hazards of the scenario families, each so near that a driver who does nothing meets it."""


class Met(NamedTuple):
    """How an approach ended."""

    impact_mps: float
    """The closing speed with which they meet; 0: they do not."""
    braked_ttc_s: float | None = None
    """Gap over closing speed as braking began; `None`: nothing braked, or the gap was not closing."""


def impact_mps(approach: Approach, profile: Profile) -> float:
    """The closing speed with which they meet; 0: they do not."""
    return meet(approach, profile).impact_mps


def meet(approach: Approach, profile: Profile) -> Met:
    """Let the arbiter brake the ego, and not its driver."""
    state, gap, ego, lead, accel = fresh(profile), approach.gap_m, approach.ego_mps, approach.lead_mps, 0.0
    began_s: float | None = None
    for number in range(round(LONGEST_S / TICK_S)):
        now_ns = 10_000_000_000 + number * TICK_NS
        track = _track(approach, number, gap, lead - ego)
        verdict = decide(_request(number, track, ego, accel), _inputs(track, ego, accel, state, now_ns), profile)
        state, accel = verdict.state, -verdict.decision.brake_mps2
        if began_s is None and accel < 0.0:
            began_s = ttc_s(gap, ego - lead)
        ego_after, lead_after = max(0.0, ego + accel * TICK_S), max(0.0, lead - approach.lead_brakes_mps2 * TICK_S)
        gap -= (ego + ego_after - lead - lead_after) / 2.0 * TICK_S
        ego, lead = ego_after, lead_after
        if gap <= 0.0:
            return Met(max(0.0, ego - lead), began_s)
        if ego <= lead and approach.lead_brakes_mps2 == 0.0:
            return Met(0.0, began_s)
    return Met(0.0, began_s)


def mean_impact_mps(profile: Profile) -> float:
    """Over all approaches."""
    return sum(impact_mps(each, profile) for each in APPROACHES) / len(APPROACHES)


def _track(approach: Approach, number: int, gap_m: float, vx_mps: float) -> Track:
    return Track(
        track_id=7, kind=approach.kind, x_m=gap_m + (EGO_M + LEAD_M) / 2.0, y_m=0.0, vx_mps=vx_mps, vy_mps=0.0,
        length_m=LEAD_M, sigma_x_m=0.3, sigma_vx_mps=0.5, confidence=approach.confidence, age_s=number * TICK_S, steady_s=number * TICK_S,
        in_ego_path=True, clearance_m=-1.8, sigma_y_m=0.3,
    )  # fmt: skip


def _request(number: int, track: Track, ego_mps: float, accel_mps2: float) -> ArbitrationRequest:
    fused = Fused(
        target_mps=ego_mps, legal_limit=None, headway_factor=1.0, directive="", justification="",
        confidence=track.confidence, urgency="info", topic="", new_information=False,
    )  # fmt: skip
    person = track.kind == "pedestrian"
    return ArbitrationRequest(
        tick=number + 1, stamp_ns=0, fused=fused, ego_speed_mps=ego_mps, ego_acceleration_mps2=accel_mps2,
        lead=None if person else track, pedestrian=track if person else None,
        h=0.0, brake_envelope=1.0, mu_low=0.6, mu_high=0.8,
    )  # fmt: skip


def _inputs(track: Track, ego_mps: float, accel_mps2: float, state: ArbiterState, now_ns: int) -> Inputs:
    view = View(
        ego_speed_mps=ego_mps, ego_acceleration_mps2=accel_mps2, actors=(track,), h=0.0, brake_envelope=1.0, mu_low=0.6, mu_high=0.8
    )  # fmt: skip
    reading = Reading(
        view=view, pedals=Pedals(brake=0.0, accelerator=0.0, steering_rad=0.0), tracks_age_s=0.05, ego_age_s=0.02
    )
    return Inputs(reading=reading, state=state, permission=GRANTED, now_ns=now_ns)
