"""Requests, readings and hypothesis strategies of the arbiter's tests."""

from typing import Any

import msgspec
from hypothesis import settings
from hypothesis import strategies as st

from proto.decision import ArbitrationRequest, Fused
from proto.perception import Track
from services.arbiter.assessment.assess import View, gap_m
from services.arbiter.assessment.reading import Pedals, Reading
from services.arbiter.braking.act import Permission
from services.arbiter.decide import Inputs, decide, request_view
from services.arbiter.profiles.profile import Profile, load
from services.arbiter.state import ArbiterState, Sighting, fresh

SECOND = 1_000_000_000
FEW = settings(max_examples=60, deadline=None)
"""For properties that are cheap to state and dear to run."""
CALIBRATED = load("calibrated")
PAPER = load("paper")
GRANTED = Permission(grant_id="g-1", max_deceleration_mps2=4.0, max_duration_s=2.0, refused="")
IN_LINE_M = -1.85
"""The clearance of two cars in one line."""
HANDS_OFF = Pedals(brake=0.0, accelerator=0.2, steering_rad=0.0)


def track(gap_m: float = 15.0, closing_mps: float = 12.0, **fields: Any) -> Track:
    """A well-seen lead car; both cars 4.5 m long and, unless told otherwise, in one line."""
    return Track(
        **{
            "track_id": 7, "kind": "vehicle", "x_m": gap_m + 4.5, "y_m": 0.0, "vx_mps": -closing_mps, "vy_mps": 0.0,
            "sigma_x_m": 0.3, "sigma_vx_mps": 0.3, "confidence": 0.95, "age_s": 2.0, "steady_s": 2.0, "in_ego_path": True,
            "clearance_m": IN_LINE_M, **fields,
        }
    )  # fmt: skip


def fused(**fields: Any) -> Fused:
    """Advice that is worth saying."""
    return Fused(
        **{
            "target_mps": 13.0, "legal_limit": None, "headway_factor": 1.0, "directive": "Keep to 50 km/h",
            "justification": "", "confidence": 0.9, "urgency": "advice", "topic": "limit", "new_information": True,
            **fields,
        }
    )  # fmt: skip


def request(lead: Track | None = None, **fields: Any) -> ArbitrationRequest:
    """A request at 20 m/s on a surface well known to be wet."""
    return ArbitrationRequest(
        **{
            "tick": 1, "stamp_ns": SECOND, "fused": fused(), "ego_speed_mps": 20.0, "ego_acceleration_mps2": 0.0,
            "lead": lead, "h": 0.0, "brake_envelope": 1.0, "mu_low": 0.5, "mu_high": 0.6, **fields,
        }
    )  # fmt: skip


def mirror(asked: ArbitrationRequest, **fields: Any) -> Inputs:
    """The arbiter sees with its own eyes what it is asked about."""
    view = request_view(asked)
    reading = Reading(view=view, pedals=HANDS_OFF, tracks_age_s=0.05, ego_age_s=0.02)
    profile: Profile = fields.pop("profile", CALIBRATED)
    now_ns = fields.setdefault("now_ns", 10 * SECOND)
    fields.setdefault("state", watched(fresh(profile), view, now_ns, profile))
    return Inputs(
        **{
            "reading": fields.pop("reading", reading), "permission": fields.pop("permission", GRANTED), **fields,
        }
    )  # fmt: skip


def watched(state: ArbiterState, view: View, now_ns: int, profile: Profile) -> ArbiterState:
    """As if every actor had been watched closing in for half a second at the speed it has."""
    back = (500, 400, 300, 200, 100)
    sightings = tuple(
        Sighting(
            track_id=t.track_id,
            gap_m=gap_m(t, profile) - t.vx_mps * ms / 1e3,
            stamp_ns=now_ns - 50_000_000 - ms * 1_000_000,
        )
        for ms in back
        for t in view.actors
    )
    return msgspec.structs.replace(state, sightings=sightings)


def with_view(inputs: Inputs, **fields: Any) -> Inputs:
    """Another own view."""
    view = msgspec.structs.replace(inputs.reading.view, **fields)
    return msgspec.structs.replace(inputs, reading=msgspec.structs.replace(inputs.reading, view=view))


probability = st.floats(0.0, 1.0)
tracks = st.builds(
    track,
    gap_m=st.floats(0.0, 120.0),
    closing_mps=st.floats(-20.0, 40.0),
    ax_mps2=st.floats(-8.0, 3.0),
    sigma_x_m=st.floats(0.0, 5.0),
    sigma_vx_mps=st.floats(0.0, 5.0),
    confidence=probability,
    age_s=st.floats(0.0, 5.0),
    unseen_s=st.floats(0.0, 1.0),
    steady_s=st.none() | st.sampled_from([0.0, 0.1]) | st.floats(0.0, 5.0),
    oncoming=st.booleans(),
)
people = st.builds(track, kind=st.just("pedestrian"), gap_m=st.floats(0.0, 60.0), track_id=st.just(8))
mu = st.floats(0.05, 1.0)


@st.composite
def requests(draw: st.DrawFn) -> ArbitrationRequest:
    """Any situation, critical ones among them."""
    low, high = sorted((draw(mu), draw(mu)))
    return request(
        lead=draw(st.none() | tracks),
        pedestrian=draw(st.none() | people),
        fused=fused(
            confidence=draw(probability),
            hazard=draw(st.sampled_from(("", "closing_lead"))),
            muted=draw(st.booleans()),
            new_information=draw(st.booleans()),
            first_notice=draw(st.booleans()),
        ),
        ego_speed_mps=draw(st.none() | st.floats(0.0, 50.0)),
        ego_acceleration_mps2=draw(st.none() | st.floats(-8.0, 3.0)),
        h=draw(st.none() | probability),
        brake_envelope=draw(st.none() | probability),
        mu_low=draw(st.none() | st.just(low)),
        mu_high=draw(st.none() | st.just(high)),
        following_factor=draw(st.floats(1.0, 2.0)),
        tool_timed_out=draw(st.booleans()),
    )


def acts(asked: ArbitrationRequest, inputs: object = None, profile: Profile = CALIBRATED) -> bool:
    """Whether the arbiter would brake, grant or no grant."""
    verdict = decide(asked, inputs or mirror(asked), profile)  # type: ignore[arg-type]
    return verdict.decision.kind == "ACT" or verdict.decision.act_withheld != ""
