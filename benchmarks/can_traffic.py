"""Subjects: fully loaded buses fed over Zenoh, and plain cantools hearing them.

`python -m benchmarks.can_traffic ENDPOINT feed|cantools BUSES SECONDS`
"""

import json
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

from cantools.database import load_string

from drivemcp.bus.received import Received
from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from drivemcp.paths import data
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import MESSAGES, FrameEncoder

FRAMES_PER_S = 4000
"""A 500 kbit/s bus full of frames of 8 bytes."""
BATCH_S = 0.005
IN_BATCH = round(FRAMES_PER_S * BATCH_S)
OTHERS = 65
CURATED_IN_BATCH = 7
"""Of 20 frames so many are of the described car's messages."""
SPEED = "Motion"
"""Leads each batch, so that its age in an ego is that of the oldest frame that came with it."""
TURNS = 240
"""A message's counter starts again after 16 frames, or 15."""


def others() -> str:
    """What a bus carries beside what is curated: ids from 0x400, eight signals each, as a DBC."""
    lines = ['VERSION "1"', "BS_:", "BU_: A"]
    for number in range(OTHERS):
        lines.append(f"BO_ {0x400 + number} Other{number}: 8 A")
        lines += [f' SG_ Other{number}_{i} : {8 * i}|8@1+ (0.5,-10) [0|0] "" A' for i in range(8)]
    return "\n".join(lines) + "\n"


class Slot(NamedTuple):
    """One id, and its payloads in turn."""

    arbitration_id: int
    payloads: tuple[bytes, ...]


def slots(messages: tuple[str, ...]) -> tuple[list[Slot], list[Slot]]:
    """(curated, other): a car at 20 m/s."""
    encoder, state = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel().step(0.02, Controls(speed_mps=20.0))
    curated = []
    for name in messages:
        frames = [encoder.encode(name, state) for _ in range(TURNS)]
        curated.append(Slot(frames[0].arbitration_id, tuple(frame.data for frame in frames)))
    return curated, [Slot(0x400 + n, tuple(bytes([turn, n] * 4) for turn in range(TURNS))) for n in range(OTHERS)]


def messages_of(bus: int, buses: int) -> tuple[str, ...]:
    """Which of the car's messages a bus carries, the first one the speed's; its frames are as many whatever these are."""
    return tuple(sorted(MESSAGES, key=lambda name: name != SPEED))[bus::buses]


class Traffic:
    """A bus's frames without end; the first of a batch is of the first curated message."""

    def __init__(self, bus: int, buses: int) -> None:
        curated, self._other = slots(messages_of(bus, buses))
        self._first, self._curated = curated[:1], curated[1:]
        self._sent: dict[int, int] = {}

    def batch(self, end_ns: int) -> CanFrames:
        """The frames of the last 5 ms."""
        gap = round(1e9 / FRAMES_PER_S)
        return CanFrames(frames=tuple(self._next(i, end_ns - (IN_BATCH - 1 - i) * gap) for i in range(IN_BATCH)))

    def _next(self, place: int, stamp_ns: int) -> CanFrame:
        pool = self._first if place == 0 else self._curated if place < CURATED_IN_BATCH else self._other
        number = self._sent.get(id(pool), 0)
        self._sent[id(pool)] = number + 1
        slot, turn = pool[number % len(pool)], number // len(pool) % TURNS
        return CanFrame(stamp_ns=stamp_ns, arbitration_id=slot.arbitration_id, data=slot.payloads[turn])


def feed(node: Node, buses: int, seconds: float) -> int:
    """Send in real time; the frames sent. What could not be sent in time is sent late, not left out."""
    traffic = [Traffic(bus, buses) for bus in range(buses)]
    started = time.monotonic()
    for number in range(round(seconds / BATCH_S)):
        while (left := started + number * BATCH_S - time.monotonic()) > 0:
            time.sleep(left)
        for bus, each in enumerate(traffic):
            node.publish(topics.CAN_RX, each.batch(time.time_ns()), id=f"can{bus}")
    return round(seconds / BATCH_S) * IN_BATCH * buses


class PlainCantools:
    """Decodes every frame with cantools alone."""

    def __init__(self, node: Node, buses: int) -> None:
        texts = (Path(data("vehicles/sim/sim.dbc")).read_text(encoding="utf-8"), others())
        databases: list[Any] = [load_string(text, "dbc") for text in texts]
        self._messages = {message.frame_id: message for each in databases for message in each.messages}
        self.frames = 0
        for bus in range(buses):
            node.subscribe(topics.CAN_RX, self._take, id=f"can{bus}")

    def _take(self, message: CanFrames, _: Received[CanFrames]) -> None:
        for frame in message.frames:
            self._messages[frame.arbitration_id].decode(frame.data)
        self.frames += len(message.frames)


def main() -> None:
    """Run one of the two; the listener until its standard input ends."""
    where, role, buses, seconds = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
    with open_bus(BusConfig(connect=(where,))) as bus:
        node = Node(bus, "player" if role == "feed" else "bench_cantools", ServiceConfig())
        listener = PlainCantools(node, buses) if role == "cantools" else None
        node.open(announce=False)
        if listener is None:
            frames = feed(node, buses, seconds)
        else:
            sys.stdin.read()
            frames = listener.frames
        print(json.dumps({"frames": frames}))  # noqa: T201
        node.close()


if __name__ == "__main__":
    main()
