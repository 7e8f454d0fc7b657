"""The arbiter on a real in-process bus."""

import math
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from drivemcp.errors import ConfigError
from drivemcp.node import Node
from drivemcp.runtime.grants import make_key, sign_grant
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.decision import BrakeCommand, Decision, Feedback, Grant
from proto.perception import Tracks
from proto.vehicle import Degradation, Ego
from proto.weather import Conditions
from services.arbiter.decide import redecide
from services.arbiter.profiles.profile import load
from services.arbiter.service import SERVICE, ArbiterConfig
from tests.unit.services.arbiter.support import request, track

LEAD = track(gap_m=15.0, closing_mps=12.0)
CRITICAL = request(LEAD)


def show(node: Node, gap_m: float, track_id: int, stamp_ns: int) -> None:
    """What perception, CAN and weather would publish of one instant."""
    lead = track(gap_m=gap_m, closing_mps=12.0, track_id=track_id)
    ego = Ego(speed_mps=20.0, acceleration_mps2=0.0, brake_pedal=0.0, accelerator_pedal=0.2, steering_angle_rad=0.0)
    node.publish(topics.EGO, ego)
    node.publish(topics.DEGRADATION, Degradation(h=0.0, brake_envelope=1.0))
    node.publish(
        topics.CONDITIONS,
        Conditions(precipitation="rain", rain_mm_h=5.0, visibility_m=900.0, mu_low=0.5, mu_high=0.6,
                   risk_level="moderate", speed_factor=0.9, following_factor=1.0, confidence=0.9),
    )  # fmt: skip
    shown = Tracks(camera="front", frame=1, tracks=(lead,), lead_track_id=track_id)
    node.publish(topics.TRACKS, shown, stamp_ns=stamp_ns)


def arbitrate(b: TestBus, node: Node) -> Decision:
    """The decision, once the arbiter has watched a car close in by itself: in two pictures, 0.27 s apart."""
    orchestrator = b.node("orchestrator")
    for attempt in range(1, 60):
        now_ns, track_id = time.time_ns(), 100 + attempt
        for back_ns, gap_m in ((270_000_000, 18.24), (0, 15.0)):
            show(node, gap_m, track_id, now_ns - back_ns)
            asked = msgspec.structs.replace(CRITICAL, tick=attempt, lead=track(gap_m=gap_m, track_id=track_id))
            outcome = b.call("arbitrate", {"request": asked}, caller=orchestrator)
            assert outcome.ok, outcome.error
        decision = msgspec.convert(outcome.result, Decision)
        own = decision.own
        now = [(each["track_id"], each["x_m"]) for each in own["reading"]["view"]["actors"]]
        before = [each[1] for each in own["state"]["sightings"] if each[0] == track_id]
        if now == [(track_id, 19.5)] and before and before[0] > 18.0:
            return decision
    raise AssertionError("the arbiter never read its own topics")


def grant_file(folder: Path, private: str, **fields: object) -> str:
    now = datetime.now(UTC)
    given = {
        "grant_id": "g-test", "vehicle": "ego", "capability": "actuation/brake", "max_deceleration_mps2": 3.0,
        "max_duration_s": 2.0, "issued_at": (now - timedelta(hours=1)).isoformat(),
        "expires_at": (now + timedelta(hours=1)).isoformat(), **fields,
    }  # fmt: skip
    file = folder / "grant.json"
    file.write_bytes(msgspec.json.encode(sign_grant(msgspec.convert(given, Grant), private)))
    return str(file)


def test_without_a_grant_it_says_what_was_withheld(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE, ArbiterConfig(out_dir=str(tmp_path)))
        decision = arbitrate(b, b.node("probe"))
        assert decision.act_withheld == "no grant"
        assert decision.kind != "ACT"
        assert decision.brake_mps2 == 0.0


def test_under_a_grant_it_publishes_bounded_braking(tmp_path: Path) -> None:
    key = make_key()
    config = ArbiterConfig(
        out_dir=str(tmp_path), grant_file=grant_file(tmp_path, key.private), trusted_keys=(key.public,)
    )
    with bus() as b:
        b.start(SERVICE, config)
        commands = b.collect(topics.BRAKE)
        decision = arbitrate(b, b.node("probe"))
        assert decision.kind == "ACT"
        command: BrakeCommand = commands.wait()
        assert command.grant_id == "g-test"
        assert 0.0 < command.deceleration_mps2 <= 3.0


@pytest.mark.parametrize("taken", ["grant", "key"])
def test_a_grant_that_is_taken_back_while_driving_is_over_with_the_next_decision_and_does_not_come_back(
    tmp_path: Path, taken: str
) -> None:
    key, keys = make_key(), tmp_path / "keys"
    keys.write_text(f"# the fleet's\n{key.public}\n")
    config = ArbiterConfig(
        out_dir=str(tmp_path), grant_file=grant_file(tmp_path, key.private), trusted_keys_file=str(keys)
    )
    file = tmp_path / "grant.json" if taken == "grant" else keys
    content = file.read_bytes()
    with bus() as b:
        b.start(SERVICE, config)
        probe = b.node("probe")
        assert arbitrate(b, probe).kind == "ACT"
        file.unlink()
        assert arbitrate(b, probe).kind != "ACT"
        file.write_bytes(content)
        assert arbitrate(b, probe).kind != "ACT"
    with bus() as b:
        b.start(SERVICE, config)
        decision = arbitrate(b, b.node("probe"))
        assert decision.act_withheld == "grant 'g-test' has ended, or a later one took its place"
        assert decision.brake_mps2 == 0.0
    grant_file(tmp_path, key.private, grant_id="g-2", sequence=1)
    with bus() as b:
        b.start(SERVICE, config)
        assert arbitrate(b, b.node("probe")).kind == "ACT"


@pytest.mark.parametrize(
    "fields",
    [
        {"vehicle": "other"},
        {"capability": "tool:clear_dtcs"},
        {"expires_at": (datetime.now(UTC) - timedelta(minutes=1)).isoformat()},
    ],
)
def test_a_grant_for_something_else_is_none(tmp_path: Path, fields: dict[str, object]) -> None:
    key = make_key()
    config = ArbiterConfig(
        out_dir=str(tmp_path), grant_file=grant_file(tmp_path, key.private, **fields), trusted_keys=(key.public,)
    )
    with bus() as b:
        b.start(SERVICE, config)
        assert arbitrate(b, b.node("probe")).act_withheld.startswith("grant 'g-test' is")


def test_a_grant_by_a_stranger_is_none(tmp_path: Path) -> None:
    config = ArbiterConfig(
        out_dir=str(tmp_path), grant_file=grant_file(tmp_path, make_key().private), trusted_keys=(make_key().public,)
    )
    with bus() as b:
        b.start(SERVICE, config)
        assert "no trusted key" in arbitrate(b, b.node("probe")).act_withheld


def test_a_request_alone_never_brakes(tmp_path: Path) -> None:
    """Nobody publishes tracks: whatever a caller claims, the arbiter has not seen it."""
    key = make_key()
    config = ArbiterConfig(
        out_dir=str(tmp_path), grant_file=grant_file(tmp_path, key.private), trusted_keys=(key.public,)
    )
    with bus() as b:
        b.start(SERVICE, config)
        outcome = b.call("arbitrate", {"request": CRITICAL}, caller=b.node("orchestrator"))
        assert outcome.result is not None
        assert outcome.result["kind"] == "SPEAK"


def test_the_last_decision_can_be_explained(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE, ArbiterConfig(out_dir=str(tmp_path)))
        decision = arbitrate(b, b.node("probe"))
        outcome = b.call("explain_decision", {})
        assert outcome.result is not None
        assert outcome.result["decision"]["tick"] == decision.tick
        assert "Smallest change" in outcome.result["text"]
        assert b.call("explain_decision", {"tick": 99999}).status == "tool_error"


def test_only_the_orchestrator_may_ask_for_a_decision(tmp_path: Path) -> None:
    """Another caller could use up the voice for a hazard, or talk Delta down by feedback."""
    with bus() as b:
        b.start(SERVICE, ArbiterConfig(out_dir=str(tmp_path)))
        decisions = b.collect(topics.DECISION)
        refused = b.call("arbitrate", {"request": CRITICAL}, caller=b.node("gateway"))
        assert refused.status == "protocol_error"
        assert "orchestrator alone" in refused.error
        assert b.call("arbitrate", {"request": CRITICAL}, caller=b.node("orchestrator")).ok
        assert len(decisions.wait_count(1)) == 1


def test_feedback_outlives_the_service(tmp_path: Path) -> None:
    config = ArbiterConfig(out_dir=str(tmp_path))
    for count in (1, 2):
        with bus() as b:
            b.start(SERVICE, config)
            asked = msgspec.structs.replace(CRITICAL, feedback=(Feedback(label="late_warning"),))
            outcome = b.call("arbitrate", {"request": asked}, caller=b.node("orchestrator"))
            assert outcome.result is not None
            assert outcome.result["metrics"]["delta"] == pytest.approx(0.2 - 0.02 * count, abs=1e-3)


def test_a_drive_may_begin_with_what_earlier_ones_have_left(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE, ArbiterConfig(out_dir=str(tmp_path), learnt=(0.1, 0.6)))
        metrics = arbitrate(b, b.node("probe")).metrics
        assert (metrics.delta, metrics.c_min) == pytest.approx((0.1, 0.6), abs=1e-3)


@pytest.mark.parametrize(
    "settings", [{"profile": "nowhere"}, {"delta": 0.9}, {"learnt": (0.9, 0.5)}, {"learnt": (0.1, 1.0)}]
)
def test_a_profile_that_is_none_is_a_users_mistake(settings: dict[str, object]) -> None:
    with bus() as b, pytest.raises(ConfigError):
        b.start(SERVICE, msgspec.convert(settings, ArbiterConfig))


def test_a_number_that_is_none_in_what_it_reads_leaves_its_decision_decidable_again(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE, ArbiterConfig(out_dir=str(tmp_path)))
        node, orchestrator = b.node("probe"), b.node("orchestrator")
        broken = Tracks(camera="front", frame=1, tracks=(track(track_id=8, ax_mps2=math.nan), track(track_id=9)))
        for attempt in range(1, 60):
            node.publish(topics.EGO, Ego(speed_mps=math.inf, acceleration_mps2=0.0))
            node.publish(topics.TRACKS, broken)
            asked = msgspec.structs.replace(CRITICAL, tick=attempt)
            outcome = b.call("arbitrate", {"request": asked}, caller=orchestrator)
            assert outcome.ok, outcome.error
            decision = msgspec.convert(outcome.result, Decision)
            actors = decision.own["reading"]["view"]["actors"]
            if actors:
                break
        assert [each["track_id"] for each in actors] == [9]
        assert decision.own["reading"]["view"]["ego_speed_mps"] is None
        assert redecide(asked, decision, load("calibrated")).decision == decision
