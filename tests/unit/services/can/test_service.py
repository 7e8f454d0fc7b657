"""The CAN service on a real in-process bus, with simulated control units at the other end."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any

import pytest

from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.can.buses.opening import BusConfig
from services.can.service import SERVICE, CanConfig
from services.can.tools.requests import MAX_WAIT_S
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder


class Car:
    """The other end of the bus: a simulated car, fed on the worker thread of its own node."""

    def __init__(self, node: Node, controls: Controls) -> None:
        self.node, self.controls = node, controls
        self.model, self.ecus = CarModel(), EcuBank()
        self.encoder = FrameEncoder(data("vehicles/sim/sim.dbc"))
        self.sent: list[CanFrame] = []
        self.mute = False
        self.noise: list[CanFrame] = []
        self._last_ns = node.clock.now_ns()
        node.subscribe(topics.CAN_TX, self._on_tx, id="can0")
        node.every(0.02, self._step)

    def _step(self) -> None:
        now_ns = self.node.clock.now_ns()
        self.model.step((now_ns - self._last_ns) / 1e9, self.controls)
        self._last_ns = now_ns
        state = self.ecus.affect(self.model.state, now_ns)
        frames = self.noise + self.encoder.due(state, now_ns) + self.ecus.step(now_ns)
        if not self.mute:
            self._publish(frames)

    def _on_tx(self, message: CanFrames, info: Any) -> None:
        now_ns = self.node.clock.now_ns()
        state = self.ecus.affect(self.model.state, now_ns)
        self.sent.extend(message.frames)
        self._publish(self.noise + [a for frame in message.frames for a in self.ecus.on_frame(frame, state, now_ns)])

    def _publish(self, frames: list[CanFrame]) -> None:
        self.node.publish(topics.CAN_RX, CanFrames(frames=tuple(frames)), id="can0")


Driving = Callable[..., AbstractContextManager[tuple[TestBus, Car]]]


@pytest.fixture
def driving(patient: str) -> Driving:
    @contextmanager
    def drive(profile: str = patient, **how: Any) -> Iterator[tuple[TestBus, Car]]:
        controls = {name: how.pop(name) for name in list(how) if name in Controls.__dataclass_fields__}
        with bus() as b:
            b.start(SERVICE, CanConfig(profile=profile, **how))
            car = Car(b.node("simulator"), Controls(**({"speed_mps": 20.0} | controls)))
            b.wait_for(topics.EGO, lambda ego: ego.speed_mps is not None)
            yield b, car

    return drive


def result(b: TestBus, tool: str, **arguments: Any) -> dict[str, Any]:
    outcome = b.call(tool, arguments)
    assert outcome.ok, outcome
    assert outcome.result is not None
    return outcome.result


def test_the_ego_is_what_the_car_does(driving: Driving) -> None:
    with driving(speed_mps=13.9, wiper_stage=2, outside_temperature_c=7.0, headlamps=2, indicator="left") as (b, _):
        ego = b.wait_for(topics.EGO, lambda ego: ego.wiper_stage is not None)
    assert ego.speed_mps == pytest.approx(13.9, abs=0.02)
    assert (ego.wiper_stage, ego.outside_temperature_c, ego.lamps_on, ego.indicator) == (2, 7.0, True, "left")
    assert ego.invalid == ()


def test_a_bus_that_falls_silent_makes_the_ego_unknown_and_not_zero(driving: Driving) -> None:
    with driving(profile=CanConfig().profile) as (b, car):
        car.mute = True
        ego = b.wait_for(topics.EGO, lambda ego: ego.speed_mps is None)
    assert "speed_mps" in ego.invalid


def test_a_healthy_car_has_no_degradation_and_full_brakes(driving: Driving) -> None:
    with driving() as (b, _):
        degradation = b.wait_for(topics.DEGRADATION, lambda message: not message.unknown)
        answer = result(b, "vehicle_health")
    assert degradation.h == 0.0
    assert degradation.brake_envelope == 1.0
    assert (answer["safe_to_drive"], answer["speed_factor"], answer["headway_factor"]) == ("yes", 1.0, 1.0)


def test_an_injected_fault_reaches_degradation_codes_lamps_and_advice(driving: Driving) -> None:
    with driving(allow_fault_scenarios=True) as (b, car):
        answer = result(b, "activate_fault_scenario", preset="abs_fault")
        degradation = b.wait_for(
            topics.DEGRADATION, lambda message: "C0035" in message.dtcs and "abs" in message.warning_lamps
        )
        report = result(b, "read_dtcs", language="de")
        health = result(b, "vehicle_health")
    assert answer["status"] == "ok"
    assert answer["dtcs"] == ["C0035"]
    assert car.ecus.active == ("abs_fault",)
    assert degradation.h is not None
    assert degradation.h > 0.3
    assert degradation.brake_envelope == pytest.approx(0.75)
    assert "Raddrehzahlgeber vorn" in report["stored"][0]["summary"]
    assert health["safe_to_drive"] == "with_care"
    assert health["speed_factor"] < 0.9


def test_fault_scenarios_are_refused_unless_the_configuration_allows_them(driving: Driving) -> None:
    with driving() as (b, car):
        answer = result(b, "activate_fault_scenario", preset="overheat")
        assert answer["status"] == "refused"
        assert car.ecus.active == ()


def test_obd_speed_follows_the_wheels(driving: Driving) -> None:
    with driving(speed_mps=25.0) as (b, car):
        fast = result(b, "send_obd_request", service=1, pid=0x0D)
        car.controls = Controls(speed_mps=10.0)
        b.wait_for(topics.EGO, lambda ego: ego.speed_mps is not None and ego.speed_mps < 10.5)
        slow = result(b, "send_obd_request", service=1, pid=0x0D)
    assert fast["decoded"]["vehicle_speed"] == 90
    assert slow["decoded"]["vehicle_speed"] == 36
    assert (fast["arbitration_id"], fast["response_service"], fast["pid"]) == ("0x7E8", 0x41, 0x0D)


def test_an_answer_is_matched_among_answers_to_other_questions(driving: Driving) -> None:
    with driving() as (b, car):
        car.noise = [
            CanFrame(stamp_ns=0, arbitration_id=0x7E8, data=bytes([3, 0x41, 0x0C, 0xFF, 0xFF, 0, 0, 0])),
            CanFrame(stamp_ns=0, arbitration_id=0x7E9, data=bytes([3, 0x42, 0x0D, 0x01, 0, 0, 0, 0])),
            CanFrame(stamp_ns=0, arbitration_id=0x100, data=bytes([3, 0x41, 0x0D, 0x01, 0, 0, 0, 0])),
        ]
        answers = [result(b, "send_obd_request", service=1, pid=0x0D) for _ in range(20)]
    assert {answer["decoded"]["vehicle_speed"] for answer in answers} == {72}


def test_a_long_answer_arrives_whole_by_flow_control(driving: Driving) -> None:
    with driving() as (b, car):
        answer = result(b, "send_obd_request", service=9, pid=4, ecu="engine")
    assert answer["decoded"]["calibration_id"] == "DRIVEMCP-SIM-001"
    assert any(frame.data[0] == 0x30 for frame in car.sent)


def test_a_diagnostic_request_returns_when_answered_and_not_at_its_timeout(driving: Driving) -> None:
    with driving() as (b, _):
        started = time.monotonic()
        answer = result(b, "send_diagnostic_request", service_id=0x3E, timeout_s=MAX_WAIT_S)
        elapsed_s = time.monotonic() - started
    assert sorted(response["ecu"] for response in answer["responses"]) == ["body", "brakes", "engine", "transmission"]
    assert elapsed_s < MAX_WAIT_S


@pytest.mark.parametrize(("service", "pid"), [(0x04, None), (0x08, None), (0x2F, None)])
def test_a_request_that_changes_the_car_never_leaves(driving: Driving, service: int, pid: int | None) -> None:
    with driving(poll_dtcs_s=0.0) as (b, car):
        answer = result(b, "send_obd_request", service=service, pid=pid)
        assert answer["status"] == "refused"
    assert car.sent == []  # what was sent before the bus closed has come by now


def test_clearing_codes_is_refused_without_a_grant(driving: Driving) -> None:
    with driving(poll_dtcs_s=0.0) as (b, car):
        outcome = b.call("clear_dtcs")
        assert outcome.status == "protocol_error"
        assert "grant" in outcome.error
    assert car.sent == []


def test_reading_tools_keep_the_names_and_shapes_of_the_catalogue(driving: Driving) -> None:
    with driving() as (b, _):
        rows = result(b, "read_can_frames", duration_s=60.0)["result"]
        speeds = result(b, "filter_frames", signal_name="VehicleSpeed", duration_s=60.0)["result"]
        values = result(b, "monitor_signal", signal_name="VehicleSpeed", duration_s=60.0)["result"]
        snapshot = result(b, "get_vehicle_snapshot")
        decoded = result(b, "decode_can_frame", arbitration_id="0x131", data=[2, 130, 8, 0, 0, 0])
    assert {"timestamp", "arbitration_id", "data"} <= rows[0].keys()
    assert {row["arbitration_id"] for row in speeds} == {"0x101"}
    assert speeds[-1]["signal_value"] == pytest.approx(72.0)
    assert values[-1] == {"timestamp": pytest.approx(time.time(), abs=5.0), "value": pytest.approx(72.0)}
    assert snapshot["signals"]["VehicleSpeed"]["unit"] == "km/h"
    assert snapshot["frame_count"] > 0
    assert decoded["status"] == "ok"
    assert decoded["signals"]["WiperStage"] == "slow"
    assert decoded["signals"]["OutsideTemperature"] == 25.0


def test_unknown_names_are_told_and_do_not_break_the_tool(driving: Driving) -> None:
    with driving() as (b, _):
        assert b.call("monitor_signal", {"signal_name": "Flux"}).status == "tool_error"
        assert b.call("explain_dtc", {"code": "X99"}).status == "tool_error"
        assert result(b, "decode_can_frame", arbitration_id="zz", data=[])["status"] == "error"
        assert result(b, "decode_can_frame", arbitration_id=1, data=[256])["status"] == "error"


def test_a_python_can_bus_crosses_nodes(driving: Driving) -> None:
    import can

    from services.can.buses.link import NodeLink
    from services.can.buses.zenoh_bus import ZenohBus

    with driving() as (b, car):
        node = b.node("tester")
        with ZenohBus("can0", link=NodeLink(node, "can0")) as port:
            heard = [message for _ in range(200) if (message := port.recv(1.0)) and message.arbitration_id == 0x101]
            port.send(can.Message(arbitration_id=0x7DF, data=[2, 1, 0x0D, 0, 0, 0, 0, 0], is_extended_id=False))
            arrived = threading.Event()
            ends_s = time.monotonic() + 10.0
            while time.monotonic() < ends_s:
                message = port.recv(1.0)
                if message is not None and message.arbitration_id == 0x7E8 and message.data[1] == 0x41:
                    arrived.set()
                    break
    assert heard
    assert heard[0].timestamp == pytest.approx(time.time(), abs=10.0)
    assert arrived.is_set()
    assert any(frame.arbitration_id == 0x7DF for frame in car.sent)


def test_the_same_service_takes_another_python_can_interface(patient: str) -> None:
    import can

    config = CanConfig(profile=patient, buses=(BusConfig(interface="virtual", channel="edge"),))
    with bus() as b:
        b.start(SERVICE, config)
        encoder, state = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel().step(0.02, Controls(speed_mps=11.0))
        collected = b.collect(topics.EGO)
        with can.Bus(interface="virtual", channel="edge") as port:
            for _ in range(5):
                frame = encoder.encode("Motion", state)
                port.send(can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False))
            ego = collected.wait(lambda ego: ego.speed_mps is not None)
    assert ego.speed_mps == pytest.approx(11.0, abs=0.01)


@pytest.mark.parametrize("by", ["obd", "uds"])
@pytest.mark.parametrize(("speed_mps", "status", "left"), [(0.0, "ok", []), (15.0, "refused", ["P0420"])])
def test_an_authorized_clearing_works_on_a_standing_car_only(
    speed_mps: float, status: str, left: list[str], by: str, patient: str
) -> None:
    with bus() as b:
        can_node = SERVICE.start(b.session, CanConfig(profile=patient), authorize=lambda tool, head, payload: "")
        car = Car(b.node("simulator"), Controls(speed_mps=speed_mps))
        car.model.state = replace(car.model.state, stored_codes=("P0420",))
        b.wait_for(topics.EGO, lambda ego: ego.speed_mps is not None)
        before = result(b, "send_obd_request", service=3)
        answer = result(b, "clear_dtcs", by=by)
        after = result(b, "send_obd_request", service=3)
        can_node.close()
    assert before["decoded"]["stored_codes"] == ["P0420"]
    assert answer["status"] == status
    assert {response["response_code"] for response in answer["responses"]} <= {0}
    assert after["decoded"]["stored_codes"] == left


def test_the_vehicle_identification_number_stays_in_the_car(driving: Driving) -> None:
    with driving() as (b, _):
        answers = [
            result(b, "send_obd_request", service=9, pid=2),
            result(b, "read_identifier", identifier=0xF190, ecu="engine"),
            result(b, "send_diagnostic_request", service_id=0x22, parameter_id=0xF190),
        ]
    for answer in answers:
        assert answer["status"] == "ok"
        assert "WDM0SIM" not in str(answer)
        assert str(list(b"WDM0SIM"))[1:-1] not in str(answer)
    assert answers[0]["decoded"]["vin"].startswith("sha256-salted:")
    assert answers[1]["units"][0]["decoded"] == answers[0]["decoded"]


def test_the_vehicle_identification_number_is_told_where_that_is_allowed(driving: Driving) -> None:
    with driving(allow_vin=True) as (b, _):
        assert result(b, "send_obd_request", service=9, pid=2)["decoded"]["vin"] == "WDM0SIM0000000001"
