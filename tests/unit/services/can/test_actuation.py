"""The gate as a caller meets it: on a real bus, whatever is called, nothing leaves that may not."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from drivemcp.runtime import grants
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.decision import Grant
from proto.sensors import CanFrame, CanFrames
from proto.tools import Outcome
from services.can.diagnostics import gate
from services.can.diagnostics.addresses import REQUEST_IDS
from services.can.diagnostics.isotp import FLOW_FRAMES, single_frame
from services.can.service import SERVICE, CanConfig
from services.simulator.car.state import CarState
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder

KEY = grants.make_key()
COMMANDS: dict[str, dict[str, Any]] = {
    "clear_dtcs": {"by": "obd"},
    "reset_ecu": {"ecu": "body", "kind": "soft"},
    "uds_clear_dtcs": {"request_id": "0x7E3", "response_id": "0x7EB"},
}


def grant(tool: str, hours: float = 1.0) -> str:
    now = datetime.now(UTC)
    given = Grant(
        grant_id="g-test",
        vehicle="ego",
        capability=f"tool:{tool}",
        max_deceleration_mps2=1.0,
        max_duration_s=1.0,
        issued_at=(now - timedelta(hours=2)).isoformat(),
        expires_at=(now + timedelta(hours=hours)).isoformat(),
    )
    return msgspec.json.encode(grants.sign_grant(given, KEY.private)).decode()


class Car:
    """Units that answer, and what was sent to them."""

    def __init__(self, b: TestBus, speed_mps: float) -> None:
        wheels = (speed_mps, speed_mps, speed_mps, speed_mps)
        self.state, self.sent = CarState(speed_mps=speed_mps, wheel_speeds_mps=wheels), list[CanFrame]()
        self._bus, self.ecus = b, EcuBank()
        self._encoder, self._node = FrameEncoder(data("vehicles/sim/sim.dbc")), b.node("car")
        self._node.subscribe(topics.CAN_TX, lambda message, _: self._asked(message.frames), id="can0")
        self._node.every(0.02, lambda: self._say(self._encoder.due(self.state, self._node.clock.now_ns())))

    def _asked(self, frames: tuple[CanFrame, ...]) -> None:
        self.sent.extend(frames)
        now_ns = self._node.clock.now_ns()
        self._say([answer for frame in frames for answer in self.ecus.on_frame(frame, self.state, now_ns)])

    def _say(self, frames: list[CanFrame]) -> None:
        self._node.publish(topics.CAN_RX, CanFrames(frames=tuple(frames)), id="can0")

    def call(self, tool: str, arguments: dict[str, Any], grant: str = "", confirmation: str = "") -> Outcome:
        probe = self._bus.probe
        if tool not in probe.catalogue():
            probe.client.discover()
        return probe.client.call_all([(tool, arguments, 20_000.0)], grant=grant, confirmation=confirmation)[0]

    def confirmation(self, tool: str, arguments: dict[str, Any]) -> str:
        """What the service asks for when the command comes with a grant and unconfirmed."""
        return asked_confirmation(self.call(tool, arguments, grant(tool)).error)

    def hear_all(self) -> None:
        """Until all that has left so far is heard: the answer to one more question, the last on the same topic."""
        outcome = self.call("send_obd_request", {"service": 1, "pid": 0x0D})
        assert outcome.result is not None
        assert outcome.result["status"] == "ok"

    @property
    def changing(self) -> list[bytes]:
        """Frames that were no reading request and no flow control."""
        return [
            frame.data for frame in self.sent if frame.data not in FLOW_FRAMES and frame.data[1] not in gate.READING
        ]


def asked_confirmation(refusal: str) -> str:
    """The confirmation that a refusal asks for; empty where it asks for none."""
    found = re.search(r"confirmation must be '([^']+)'", refusal)
    return found[1] if found else ""


@contextmanager
def car(profile: str, speed_mps: float = 0.0, **config: Any) -> Iterator[Car]:
    chosen: dict[str, Any] = {"poll_dtcs_s": 0.0, "trusted_keys": (KEY.public,)} | config
    with bus() as b:
        b.start(SERVICE, CanConfig(profile=profile, **chosen))
        found = Car(b, speed_mps)
        b.wait_for(topics.EGO, lambda ego: ego.speed_mps is not None)
        yield found


@pytest.mark.parametrize(
    ("tool", "payload"), [("clear_dtcs", b"\x04"), ("reset_ecu", b"\x11\x03"), ("uds_clear_dtcs", b"\x14\xff\xff\xff")]
)
def test_a_granted_and_confirmed_command_on_a_standing_car_leaves(tool: str, payload: bytes, patient: str) -> None:
    with car(patient) as standing:
        arguments = COMMANDS[tool]
        outcome = standing.call(tool, arguments, grant(tool), standing.confirmation(tool, arguments))
    assert outcome.ok, outcome
    assert outcome.result is not None
    assert outcome.result["status"] == "ok"
    assert standing.changing == [single_frame(payload)]


def test_a_confirmation_serves_once(standing: Car) -> None:
    said = standing.confirmation("clear_dtcs", {"by": "uds"})
    assert standing.call("clear_dtcs", {"by": "uds"}, grant("clear_dtcs"), said).status == "ok"
    standing.hear_all()
    sent = len(standing.changing)
    replayed = standing.call("clear_dtcs", {"by": "uds"}, grant("clear_dtcs"), said)
    assert replayed.status == "protocol_error"
    assert asked_confirmation(replayed.error) not in ("", said)
    standing.hear_all()
    assert len(standing.changing) == sent
    standing.sent.clear()


@pytest.mark.parametrize("tool", COMMANDS)
def test_a_granted_and_confirmed_command_on_a_moving_car_does_not_leave(tool: str, patient: str) -> None:
    with car(patient, speed_mps=5.0) as moving:
        outcome = moving.call(tool, COMMANDS[tool], grant(tool), moving.confirmation(tool, COMMANDS[tool]))
    assert outcome.result is not None
    assert outcome.result["status"] == "refused"
    assert "moves" in outcome.result["message"]
    assert moving.changing == []


@pytest.fixture(scope="module")
def standing(patient: str) -> Iterator[Car]:
    with car(patient) as found:
        yield found


SERVICES = st.sampled_from(sorted(gate.READING | gate.ACTUATING))
READS = st.one_of(
    st.tuples(
        st.just("send_obd_request"),
        st.fixed_dictionaries(
            {"service": SERVICES | st.integers(-1, 300), "timeout_s": st.just(0.05)},
            optional={"pid": st.integers(-1, 300), "pids": st.lists(st.integers(0, 255), max_size=6)},
        ),
    ),
    st.tuples(
        st.just("send_diagnostic_request"),
        st.fixed_dictionaries(
            {"service_id": SERVICES | st.integers(0, 255), "timeout_s": st.just(0.05)},
            optional={
                "parameter_id": st.integers(0, 0xFFFF),
                "data_field": st.integers(0, 0xFFFF),
                "ecu": st.sampled_from(["engine", "body", "0x7E0"]),
            },
        ),
    ),
    st.tuples(
        st.just("uds_read_data"),
        st.fixed_dictionaries(
            {"dids": st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=3), "timeout_s": st.just(0.05)},
            optional={"request_id": st.sampled_from(["0x7E0", "0x7E3", "0x7DF", "0x100", 0x18DA10F1])},
        ),
    ),
    st.tuples(st.just("read_vin"), st.just({"timeout_s": 0.05})),
    st.tuples(st.just("activate_fault_scenario"), st.just({"preset": "overheat"})),
)
REFUSED = st.tuples(
    st.sampled_from(list(COMMANDS)),
    st.sampled_from(["none", "other tool", "expired", "good"]),
    st.sampled_from(["none", "other tool", "other arguments", "good", "text", "own nonce"]),
).filter(lambda choice: choice[1:] != ("good", "good"))


def test_no_refused_command_leaves_the_car(standing: Car) -> None:
    @settings(max_examples=40, deadline=None)
    @given(REFUSED)
    def check(choice: tuple[str, str, str]) -> None:
        tool, which_grant, which_confirmation = choice
        other = next(name for name in COMMANDS if name != tool)
        shown = {"none": "", "other tool": grant(other), "expired": grant(tool, -1.0), "good": grant(tool)}
        repeated = {
            "none": "",
            "other tool": standing.confirmation(other, COMMANDS[other]),
            "other arguments": standing.confirmation(tool, COMMANDS[tool] | {"timeout_s": 1.0}),
            "good": standing.confirmation(tool, COMMANDS[tool]),
            "text": "yes",
            "own nonce": grants.confirmation_of(tool, msgspec.json.encode(COMMANDS[tool]), "ab" * 16),
        }
        outcome = standing.call(tool, COMMANDS[tool], shown[which_grant], repeated[which_confirmation])
        assert outcome.status == "protocol_error"

    check()
    standing.hear_all()
    assert standing.changing == []


def test_no_reading_tool_makes_a_changing_frame_leave(standing: Car) -> None:
    @settings(max_examples=60, deadline=None)
    @given(st.lists(READS, min_size=1, max_size=3))
    def check(calls: list[tuple[str, dict[str, Any]]]) -> None:
        for tool, arguments in calls:
            standing.call(
                tool, arguments, grant(tool), grants.confirmation_of(tool, msgspec.json.encode(arguments), "")
            )

    check()
    standing.hear_all()
    assert standing.changing == []
    assert {frame.arbitration_id for frame in standing.sent} <= REQUEST_IDS
    assert len(standing.sent) > 5
