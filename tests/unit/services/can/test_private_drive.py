"""A drive with a planted number and planted private signals: they are on the bus, and nowhere else."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.paths import data
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.can.service import SERVICE, CanConfig
from services.logger.format.reader import messages
from services.logger.service import SERVICE as LOGGER
from services.logger.service import LoggerConfig
from services.logger.writing import log_folder
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder

VIN = "WPLANTED9VIN00042"
PHONE, SEAT = b"+4915155", b"SEATED7!"  # long, for two bytes stand everywhere by chance, in a trace id too
LATITUDE = 48.137_154_321
PRIVATE = """VERSION ""
BU_: HEAD
BO_ 1280 Phone: 8 HEAD
 SG_ CallerDigits : 0|64@1+ (1,0) [0|0] "" HEAD
BO_ 1281 Place: 8 HEAD
 SG_ Latitude : 0|64@1- (1,0) [0|0] "deg" HEAD
BO_ 1282 Seat: 8 HEAD
 SG_ SeatOfDriver : 0|64@1+ (1,0) [0|0] "" HEAD
BO_ 1283 VIN_01: 8 HEAD
 SG_ VinPart : 0|64@1+ (1,0) [0|0] "" HEAD
SIG_VALTYPE_ 1281 Latitude : 2;
"""
PLANTED = {1280: PHONE, 1281: struct.pack("<d", LATITUDE), 1282: SEAT, 1283: VIN[:8].encode()}
PRIVATE_NAMES = (b"CallerDigits", b"Latitude", b"SeatOfDriver", b"VinPart", b"SeatbeltDriver")


def _spellings() -> Iterator[bytes]:
    """Every planted thing as bytes, as text, as a list of numbers and as the number that a decoder makes of it."""
    for payload in (*PLANTED.values(), VIN.encode(), VIN[3:10].encode(), VIN[10:].encode()):
        yield payload
        for separator in (", ", ","):
            yield separator.join(map(str, payload)).encode()
        yield payload.hex().encode()
        yield msgspec.msgpack.encode(list(payload))[1:]
    yield from (str(int.from_bytes(payload, "little")).encode() for payload in (PHONE, SEAT))
    yield struct.pack(">d", LATITUDE)
    yield b"48.137154"


def _found(heap: bytes) -> list[bytes]:
    return [each for each in _spellings() if each in heap]


class Car:
    """The simulated car, whose bus carries private things too."""

    def __init__(self, b: TestBus) -> None:
        self.node = b.node("simulator")
        self.model, self.ecus = CarModel(), EcuBank(vin=VIN)
        self.encoder = FrameEncoder(data("vehicles/sim/sim.dbc"))
        self.node.subscribe(topics.CAN_TX, self._on_tx, id="can0")
        self.node.every(0.02, self._step)

    def _step(self) -> None:
        now_ns = self.node.clock.now_ns()
        state = self.model.step(0.02, Controls(speed_mps=20.0))
        planted = [CanFrame(stamp_ns=now_ns, arbitration_id=each, data=payload) for each, payload in PLANTED.items()]
        pieces = (b"\x01" + VIN[:7].encode(), b"\x02" + VIN[7:14].encode(), b"\x03" + VIN[14:].encode() + b"*")
        planted += [CanFrame(stamp_ns=now_ns, arbitration_id=0x1CEBFF00, data=each, extended=True) for each in pieces]
        self._publish(planted + self.encoder.due(state, now_ns) + self.ecus.step(now_ns))

    def _on_tx(self, message: CanFrames, info: Any) -> None:
        now_ns = self.node.clock.now_ns()
        answers = [a for frame in message.frames for a in self.ecus.on_frame(frame, self.model.state, now_ns)]
        self._publish(answers)

    def _publish(self, frames: list[CanFrame]) -> None:
        self.node.publish(topics.CAN_RX, CanFrames(frames=tuple(frames)), id="can0")


@contextmanager
def driving(folder: Path, *, raw_access: bool) -> Iterator[tuple[TestBus, dict[str, bytes]]]:
    """A drive with the logger on; all that any session published, by key."""
    (folder / "private.dbc").write_text(PRIVATE, encoding="utf-8")
    profile = data("vehicles/sim/profile.toml").read_text(encoding="utf-8")
    described = f'description = ["{data("vehicles/sim/sim.dbc")}", "private.dbc"]'
    (folder / "profile.toml").write_text(profile.replace('description = "sim.dbc"', described), encoding="utf-8")
    heard: dict[str, bytes] = {}
    with bus() as b:
        b.session.subscribe(
            "**", lambda key, payload, head: heard.update({key: heard.get(key, b"") + b"\n" + payload + head})
        )
        b.start(LOGGER, LoggerConfig(out_dir=str(folder / "drive"), flush_ms=10))
        b.start(SERVICE, CanConfig(profile=str(folder / "profile.toml"), raw_access=raw_access))
        Car(b)
        b.wait_for(topics.EGO, lambda ego: ego.speed_mps is not None)
        yield b, heard
        b.wait_for(topics.CHAIN, lambda head: head.records > 20)


CALLS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("read_can_frames", {"duration_s": 5.0}),
    ("filter_frames", {"signal_name": "VehicleSpeed"}),
    ("filter_frames", {"arbitration_id": "0x500"}),
    ("filter_frames", {"signal_name": "Latitude"}),
    ("monitor_signal", {"signal_name": "CallerDigits"}),
    ("monitor_signal", {"signal_name": "SeatbeltDriver"}),
    ("get_vehicle_snapshot", {}),
    ("send_obd_request", {"service": 9, "pid": 2}),
    ("send_diagnostic_request", {"service_id": 0x22, "parameter_id": 0xF190}),
    ("read_dtcs", {}),
    ("vehicle_health", {}),
)


def test_neither_number_nor_private_signals_leave_the_service_or_reach_the_log(tmp_path: Path) -> None:
    with driving(tmp_path, raw_access=False) as (b, heard):
        told = {f"{tool} {arguments}": b.call(tool, arguments) for tool, arguments in CALLS}
    on_the_bus = b"".join(payload for key, payload in heard.items() if key.endswith("/rx"))
    left = {key: payload for key, payload in heard.items() if not key.endswith("/rx")}
    assert PHONE in on_the_bus, "the test must plant what it looks for"
    assert {key: _found(payload) for key, payload in left.items() if _found(payload)} == {}
    answers = {name: msgspec.json.encode(outcome) for name, outcome in told.items()}
    assert {name: _found(answer) for name, answer in answers.items() if _found(answer)} == {}
    told_unasked = (
        answers["get_vehicle_snapshot {}"]
        + answers["read_can_frames {'duration_s': 5.0}"]
        + next(payload for key, payload in left.items() if key.endswith("/can/ego"))
    )
    assert [name for name in PRIVATE_NAMES if name in told_unasked] == []
    assert b"VehicleSpeed" in answers["get_vehicle_snapshot {}"]
    assert b"raw_access is off" in answers["get_vehicle_snapshot {}"]
    assert b"raw_access is off" in answers["filter_frames {'arbitration_id': '0x500'}"]
    (path,) = log_folder.logs(tmp_path / "drive" / "logs")
    assert _found(path.read_bytes()) == []
    logged = list(messages(path))
    assert {"can/ego"} <= {one.name for one in logged}
    assert _found(b"\n".join(one.data for one in logged)) == []


def test_raw_access_tells_private_signals_and_still_no_number(tmp_path: Path) -> None:
    with driving(tmp_path, raw_access=True) as (b, _):
        rows = msgspec.json.encode(b.call("read_can_frames", {"duration_s": 60.0}))
        place = b.call("monitor_signal", {"signal_name": "Latitude", "duration_s": 60.0}).result
        number = msgspec.json.encode(b.call("send_obd_request", {"service": 9, "pid": 2}))
        uds = msgspec.json.encode(b.call("read_identifier", {"identifier": 0xF190, "ecu": "engine"}))
        rows_after = msgspec.json.encode(b.call("read_can_frames", {"duration_s": 5.0}))
    assert ",".join(map(str, PHONE)).encode() in rows
    assert place is not None
    assert place["result"][-1]["value"] == pytest.approx(LATITUDE)
    assert b"sha256-salted:" in number
    assert b"sha256-salted:" in uds
    for answer in (rows, number, uds, rows_after):
        assert VIN.encode() not in answer
        assert b"allow_vin is off" in rows
        assert not any(",".join(map(str, VIN[at : at + 6].encode())).encode() in answer for at in range(12))
