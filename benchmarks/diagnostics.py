"""Right answers of control units on a busy bus, beside a client that takes the first frame it hears for the answer.

One process: the CAN service, and a car whose units answer from a state that changes with every question, so that an
answer to any other question, or to the same one a moment ago, counts as wrong.
"""

import random
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

from app.drive.summary import percentile
from benchmarks.figures import table
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.can.buses.opening import BusConfig
from services.can.service import SERVICE, CanConfig
from services.simulator.car.state import CarState
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder

REQUESTS = 10_000
NAIVE_REQUESTS = 2_000
FRAMES_PER_S = 4_000
BATCHES_PER_S = 1_000
TIMEOUT_S = 2.0
BUS = "can0"
UNITS = {"engine": 0x7E0, "transmission": 0x7E1, "brakes": 0x7E2, "body": 0x7E3}
CODES = CarState(stored_codes=("P0300", "P0700", "C0035"), pending_codes=("P0217",), lamps=frozenset({"engine", "abs"}))
FOREIGN = (b"\x41\x2e\x40", b"\x62\xf1\x8a\x41", b"\x46\x01\x00", b"\x7f\x2f\x31")
"""What units answer to another tester meanwhile: parameters that are never asked for here."""


class Question(NamedTuple):
    """A tool call, and the bytes that it must put on the bus: for one unit, or for all."""

    tool: str
    arguments: dict[str, Any]
    payload: bytes
    unit: str | None = None


def questions() -> list[Question]:
    """Different services and parameters, to one unit and to all."""
    single = (
        0x00,
        0x01,
        0x04,
        0x05,
        0x0B,
        0x0C,
        0x0D,
        0x10,
        0x11,
        0x1C,
        0x1F,
        0x2F,
        0x20,
        0x40,
        0x42,
        0x46,
        0x67,
        0xA4,
        0xA6,
    )
    asked = [Question("send_obd_request", {"service": 1, "pid": pid}, bytes([1, pid])) for pid in single]
    for group in ((0x0C, 0x0D, 0x05), (0x04, 0x0D, 0x42, 0x1C), (0xA6, 0x0C, 0x0D, 0x10, 0x11, 0x2F)):
        asked.append(Question("send_obd_request", {"service": 1, "pids": list(group)}, bytes([1, *group])))
    asked += [
        Question("send_obd_request", {"service": 2, "pid": pid}, bytes([2, pid, 0])) for pid in (0x02, 0x0C, 0x0D)
    ]
    asked += [Question("send_obd_request", {"service": each}, bytes([each])) for each in (3, 7, 10)]
    asked += [Question("send_obd_request", {"service": 9, "pid": pid}, bytes([9, pid])) for pid in (0x00, 0x04, 0x0A)]
    for identifier in (0xF197, 0xF40C, 0x0201):
        asked.append(Question("read_identifier", {"identifier": identifier}, b"\x22" + identifier.to_bytes(2, "big")))
    for unit in UNITS:
        asked.append(Question("read_identifier", {"identifier": 0x0202, "ecu": unit}, b"\x22\x02\x02", unit))
        asked.append(Question("read_unit_codes", {"ecu": unit}, b"\x19\x02\xff", unit))
    asked.append(Question("read_unit_codes", {"status_mask": 0x08}, b"\x19\x02\x08"))
    asked.append(
        Question(
            "read_unit_codes",
            {"report": "snapshot", "code": "P0300", "ecu": "engine"},
            b"\x19\x04\x03\x00\x00\x01",
            "engine",
        )
    )
    return asked


class Car:
    """The other end of the bus: cyclic frames, answers to another tester, and the units."""

    def __init__(self, node: Node, seed: int) -> None:
        self.state, self._node, self._random = CODES, node, random.Random(seed)
        self.ecus, self._encoder = EcuBank(), FrameEncoder(data("vehicles/sim/sim.dbc"))
        self.ecus.memory.observe(CODES)
        self.carried, self._stop = 0, threading.Event()
        node.subscribe(topics.CAN_TX, lambda message, _: self._asked(message.frames), id=BUS)
        self._thread = threading.Thread(target=self._drive, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """No more traffic."""
        self._stop.set()
        self._thread.join()

    def _drive(self) -> None:
        due = time.monotonic()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            due += 1.0 / BATCHES_PER_S
            self._send(self._traffic(FRAMES_PER_S // BATCHES_PER_S))

    def _traffic(self, count: int) -> list[CanFrame]:
        now_ns = self._node.clock.now_ns()
        frames = self._encoder.due(self.state, now_ns)[: count - 1]
        frames.append(self._foreign(now_ns))
        while len(frames) < count:
            unknown = self._random.randrange(0x400, 0x600)
            frames.append(CanFrame(stamp_ns=now_ns, arbitration_id=unknown, data=self._random.randbytes(8)))
        self.carried += len(frames)
        return frames

    def _foreign(self, now_ns: int) -> CanFrame:
        answer = self._random.choice(FOREIGN)
        unit = self._random.choice(tuple(UNITS.values())) + 8
        return CanFrame(stamp_ns=now_ns, arbitration_id=unit, data=(bytes([len(answer)]) + answer).ljust(8, b"\xaa"))

    def _asked(self, frames: Sequence[CanFrame]) -> None:
        state, now_ns = self.state, self._node.clock.now_ns()
        self._send([answer for frame in frames for answer in self.ecus.on_frame(frame, state, now_ns)])

    def _send(self, frames: list[CanFrame]) -> None:
        if frames:
            self._node.publish(topics.CAN_RX, CanFrames(frames=tuple(frames)), id=BUS)


class Key:
    """What the units must answer: a second set of them, asked alone on a quiet bus."""

    def __init__(self) -> None:
        self._ecus = EcuBank()
        self._ecus.memory.observe(CODES)

    def answers(self, question: Question, state: CarState) -> dict[str, bytes]:
        """Unit -> payload, of those that answer."""
        request_id = UNITS[question.unit] if question.unit else 0x7DF
        names = {request_id + 8: unit for unit, request_id in UNITS.items()}
        first = self._ask(request_id, bytes([len(question.payload)]) + question.payload, state)
        return {names[frame.arbitration_id]: self._whole(frame, state) for frame in first}

    def _whole(self, first: CanFrame, state: CarState) -> bytes:
        if first.data[0] >> 4 == 0:
            return first.data[1 : 1 + first.data[0]]
        rest = self._ask(first.arbitration_id - 8, b"\x30\x00\x00", state)
        length = (first.data[0] & 0x0F) << 8 | first.data[1]
        return (first.data[2:] + b"".join(frame.data[1:] for frame in rest))[:length]

    def _ask(self, request_id: int, payload: bytes, state: CarState) -> list[CanFrame]:
        frame = CanFrame(stamp_ns=0, arbitration_id=request_id, data=payload.ljust(8, b"\xaa"))
        return self._ecus.on_frame(frame, state, 0)


class Result(NamedTuple):
    """Milliseconds of each request, wrong ones in words, and how they ended."""

    latencies_ms: list[float]
    wrong: list[str]
    ended: dict[str, int]
    frames_per_s: float
    core_share: float


@contextmanager
def busy(seed: int = 1) -> Iterator[tuple[TestBus, Car]]:
    """The service and a car with traffic."""
    with bus() as b:
        b.start(SERVICE, CanConfig(buses=(BusConfig(name=BUS),), poll_dtcs_s=0.0))
        car = Car(b.node("car"), seed)
        try:
            b.wait_for(topics.EGO, lambda ego: ego.speed_mps is not None)
            yield b, car
        finally:
            car.close()


def moved(random_: random.Random) -> CarState:
    """A car in another state, the trouble codes as they are."""
    return replace(
        CODES,
        speed_mps=random_.uniform(0.0, 60.0),
        engine_rpm=random_.uniform(700.0, 6000.0),
        accelerator=random_.random(),
        engine_torque_nm=random_.uniform(0.0, 220.0),
        coolant_temperature_c=random_.uniform(-30.0, 120.0),
        fuel_share=random_.random(),
        battery_voltage_v=random_.uniform(11.0, 15.0),
        distance_km=random_.uniform(0.0, 300_000.0),
        gear=random_.randint(1, 6),
        brake_pressure_bar=random_.uniform(0.0, 180.0),
        wiper_stage=random_.randint(0, 3),
    )


def ours(count: int, seed: int = 1) -> Result:
    """`count` requests by the service's tools, each answer compared byte by byte."""
    random_, key, asked = random.Random(seed), Key(), questions()
    latencies, wrong, ended = list[float](), list[str](), dict[str, int]()
    with busy(seed) as (b, car):
        b.call("send_obd_request", {"service": 3})
        carried, cpu, started = car.carried, time.process_time(), time.monotonic()
        for _ in range(count):
            question, car.state = random_.choice(asked), moved(random_)
            before = time.perf_counter()
            outcome = b.call(question.tool, question.arguments, deadline_ms=20_000.0)
            latencies.append((time.perf_counter() - before) * 1e3)
            result = outcome.result or {}
            got = {unit["ecu"]: bytes(unit["raw_data"]) for unit in result.get("units", [])}
            if got != key.answers(question, car.state):
                wrong.append(f"{question.payload.hex()}: {outcome.status} {result}")
            ended[result.get("ended", "none")] = ended.get(result.get("ended", "none"), 0) + 1
        seconds = time.monotonic() - started
        share = (time.process_time() - cpu) / seconds
        return Result(latencies, wrong, ended, (car.carried - carried) / seconds, share)


class Naive:
    """Sends a request and takes the first frame that it then hears."""

    def __init__(self, node: Node) -> None:
        self._node, self._heard, self._first = node, threading.Event(), b""
        self._listening = False
        node.subscribe(topics.CAN_RX, lambda message, _: self._hear(message.frames), id=BUS)

    def ask(self, question: Question) -> bytes:
        """The payload of what it takes for the answer."""
        self._heard.clear()
        self._listening = True
        frame = CanFrame(
            stamp_ns=self._node.clock.now_ns(),
            arbitration_id=UNITS[question.unit] if question.unit else 0x7DF,
            data=(bytes([len(question.payload)]) + question.payload).ljust(8, b"\xaa"),
        )
        self._node.publish(topics.CAN_TX, CanFrames(frames=(frame,)), id=BUS)
        self._heard.wait(TIMEOUT_S)
        return self._first[1 : 1 + self._first[0]] if self._first[:1] else b""

    def _hear(self, frames: Sequence[CanFrame]) -> None:
        if self._listening:
            self._listening = False
            self._first = frames[0].data
            self._heard.set()


def naive(count: int, seed: int = 1) -> Result:
    """`count` requests by the naive client; right is what any unit answers whole in its first frame."""
    random_, key = random.Random(seed), Key()
    asked = [question for question in questions() if question.payload[0] == 1 and len(question.payload) == 2]
    latencies, wrong = list[float](), list[str]()
    with busy(seed) as (b, car):
        client = Naive(b.node("naive"))
        started, carried = time.monotonic(), car.carried
        for _ in range(count):
            question, car.state = random_.choice(asked), moved(random_)
            before = time.perf_counter()
            got = client.ask(question)
            latencies.append((time.perf_counter() - before) * 1e3)
            if got not in key.answers(question, car.state).values():
                wrong.append(question.payload.hex())
        seconds = time.monotonic() - started
        return Result(latencies, wrong, {}, (car.carried - carried) / seconds, 0.0)


def diagnostics() -> str:
    """The table."""
    found, first = ours(REQUESTS), naive(NAIVE_REQUESTS)
    for line in found.wrong[:20]:
        sys.stderr.write(f"  wrong: {line}\n")
    rows = [_row("ours: all units' whole answers", found), _row("naive: the first frame heard (single values)", first)]
    head = ["client", "requests", "right", "wrong", "p50 ms", "p99 ms"]
    p50 = percentile(found.latencies_ms, 0.5)
    ended = ", ".join(f"{count} {how}" for how, count in sorted(found.ended.items()))
    return (
        f"## Diagnostic requests at {found.frames_per_s:.0f} frames a second of other traffic\n\n{table(head, rows)}\n\n"
        f"How ours ended: {ended}. p50 ours over naive: {p50 / percentile(first.latencies_ms, 0.5):.2f}; "
        f"waiting out a timeout of {TIMEOUT_S:.0f} s over ours: {TIMEOUT_S * 1e3 / p50:.0f}. "
        f"Units, traffic and service together took {found.core_share:.0%} of one core.\n"
    )


def _row(name: str, result: Result) -> list[str]:
    count, wrong = len(result.latencies_ms), len(result.wrong)
    p50, p99 = (f"{percentile(result.latencies_ms, each):.2f}" for each in (0.5, 0.99))
    return [name, f"{count:,}", f"{count - wrong:,}", f"{wrong:,}", p50, p99]
