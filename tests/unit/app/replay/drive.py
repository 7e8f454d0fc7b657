"""A short drive as the services decide it, without a bus: real tick, real rule book, real arbiter; the road is made up."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from drivemcp.paths import data
from proto.decision import ArbitrationRequest, Decision, TraceRecord
from proto.perception import Track, Tracks
from proto.rules import Situation
from proto.scene import Fact, Facts
from proto.tools import Outcome
from proto.vehicle import Ego, VehicleHealth
from proto.weather import Conditions
from services.arbiter.assessment.assess import View
from services.arbiter.assessment.reading import Reading
from services.arbiter.decide import Inputs, decide
from services.arbiter.profiles import profile
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import fresh
from services.logger.format import signing
from services.logger.writing.log_file import DiskFile, LogFile, Origin, Record
from services.logger.writing.topic_formats import json_form
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Observations, Stamped
from services.orchestrator.state import State
from services.orchestrator.tick import tick, trace_of
from services.rules.book import RuleBook, load_book
from services.rules.limits.limit_answer import applicable_limit

STEP_NS = 100_000_000
START_NS = 1_000_000_000_000
PROFILE = profile.load("calibrated")


class Live:
    """Answers as the services would."""

    def __init__(self, book: RuleBook, profile: Profile) -> None:
        self._book, self._profile = book, profile
        self._state = fresh(profile)
        self.reading = Reading()
        self.now_ns = 0

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        return tuple(self._answer(call) for call in calls)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        inputs = Inputs(reading=self.reading, state=self._state, now_ns=self.now_ns, delta=self._profile.delta)
        verdict = decide(request, inputs, self._profile)
        self._state = verdict.state
        return verdict.decision

    def _answer(self, call: Call) -> Outcome:
        known = {"assess_weather": CONDITIONS, "vehicle_health": SOUND}
        if call.tool == "applicable_limit":
            answer: msgspec.Struct = applicable_limit(
                self._book, msgspec.convert(call.arguments["situation"], Situation)
            )
        elif call.tool in known:
            answer = known[call.tool]
        else:
            return Outcome(tool=call.tool, status="unavailable", arguments=call.arguments)
        return Outcome(tool=call.tool, status="ok", arguments=call.arguments, result=msgspec.to_builtins(answer))


def observations(i: int) -> Observations:
    """One instant: in a town, a limit of 30 is read and passed, a car ahead comes closer."""
    now_ns = START_NS + i * STEP_NS
    gap_m = max(3.0, 60.0 - i * 0.4)
    lead = Track(
        track_id=1, kind="vehicle", x_m=gap_m, y_m=0.0, vx_mps=-4.0, vy_mps=0.0, confidence=0.95, age_s=3.0, steady_s=3.0, in_ego_path=True,
        clearance_m=-1.85,
    )  # fmt: skip
    facts: tuple[Stamped[Facts], ...] = ()
    if i == 3:
        town = Fact(kind="jurisdiction", reading="DEU", confidence=0.95, frame_stamp_ns=now_ns, track_id=7)
        sign = Fact(
            kind="limit", reading="limit:30", value=30.0, unit="km/h", confidence=0.95, frame_stamp_ns=now_ns,
            track_id=9, distance_m=20.0,
        )  # fmt: skip
        facts = (Stamped(seq=1, stamp_ns=now_ns, message=Facts(facts=(town, sign))),)
    return Observations(
        now_ns=now_ns,
        tracks=Stamped(
            seq=i, stamp_ns=now_ns, message=Tracks(camera="front", frame=i, tracks=(lead,), lead_track_id=1)
        ),
        ego=Stamped(seq=i, stamp_ns=now_ns, message=Ego(speed_mps=14.0, acceleration_mps2=0.0)),
        conditions=Stamped(seq=i, stamp_ns=now_ns, message=CONDITIONS),
        facts=facts,
    )


SOUND = VehicleHealth(
    h=0.0, brake_envelope=1.0, indicators=(), dtcs=(), warning_lamps=(), safe_to_drive="yes", advice="", speed_factor=1.0,
    headway_factor=1.0, confidence=0.9,
)  # fmt: skip
CONDITIONS = Conditions(
    precipitation="rain",
    rain_mm_h=4.0,
    visibility_m=300.0,
    mu_low=0.6,
    mu_high=0.8,
    risk_level="moderate",
    speed_factor=0.9,
    following_factor=1.2,
    confidence=0.9,
    wet=True,
)


def drive(ticks: int, profile: Profile = PROFILE) -> list[TraceRecord]:
    """The traces of a drive."""
    book, refused = load_book([data(f"rulepacks/{name}") for name in ("DEU-v1", "GBR-v1")])
    assert not refused
    live, state, traces = Live(book, profile), State(), []
    for i in range(ticks):
        seen = observations(i)
        live.now_ns = seen.now_ns
        assert seen.tracks is not None
        live.reading = Reading(
            view=View(
                ego_speed_mps=14.0,
                ego_acceleration_mps2=0.0,
                actors=seen.tracks.message.tracks,
                mu_low=0.6,
                mu_high=0.8,
            ),
            tracks_age_s=0.0,
            ego_age_s=0.0,
        )
        ticked = tick(state, seen, live)
        advisory = msgspec.structs.replace(ticked.advisory, snapshot_to_advice_ms=31.4 + i)
        traces.append(trace_of(ticked, seen, {}, advisory, whole=i % 100 == 0))
        state = ticked.state
    return traces


def write_log(path: Path, traces: Sequence[TraceRecord], secrets: Path, before: Sequence[Record] = ()) -> None:
    """The traces as a closed log, other records before them."""
    signer = signing.load_or_make(secrets)
    file = LogFile(DiskFile(path), Origin(file=path.name, vehicle="ego", public_key=signer.public_hex), signer)
    records = [
        Record(
            topic="trace",
            form=json_form(TraceRecord),
            sequence=i,
            log_time_ns=trace.stamp_ns,
            publish_time_ns=trace.stamp_ns,
            data=msgspec.json.encode(trace),
        )
        for i, trace in enumerate(traces)
    ]
    file.append([*before, *records], now_ns=0)
    file.append([], now_ns=0, closed=True)
    file.finish()
    file.release()
