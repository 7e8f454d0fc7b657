"""Subject: our CAN service and Peykan's server on the same buses, each asked through the MCP SDK's client in memory.

`python -m benchmarks.peers.beside_peykan ROUNDS` prints the answers of every shared tool and the ms of each call.
"""

import json
import logging
import os
import re
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import anyio
import can
import msgspec
from mcp.client.client import Client

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.runtime import grants
from drivemcp.testing import bus
from proto.decision import Grant
from services.can.buses.link import from_message, to_message
from services.can.buses.opening import BusConfig
from services.can.service import SERVICE, CanConfig
from services.gateway.changes import Changes
from services.gateway.drives import Drives
from services.gateway.server import make_server
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder

VIN = "1M8GDM9AXKP042788"
CODES = ("P0118", "P0217")
DRIVE_S, WINDOW_S, REPLAY_SPEED = 3.0, 30.0, 6.0
KEY = grants.make_key()
EEC1_ID, ET1_ID, DM1_ID, REQUEST_PGN = 0x0CF00400, 0x18FEEE00, 0x18FECA00, 0xEA00
J1939 = f"""VERSION "1"
BS_:
BU_: A
BO_ {EEC1_ID | 1 << 31} EEC1: 8 A
 SG_ TORQUE_OF_EEC1 : 16|8@1+ (1,-125) [0|0] "%" A
 SG_ SPEED_OF_EEC1 : 24|16@1+ (0.125,0) [0|0] "rpm" A
BO_ {ET1_ID | 1 << 31} ET1: 8 A
 SG_ COOLANT_OF_ET1 : 0|8@1+ (1,-40) [0|0] "degC" A
"""
"""Two groups of SAE J1939-71, described for this comparison."""
EEC1 = bytes([0xFF, 0xFF, 150, 0x40, 0x1F, 0xFF, 0xFF, 0xFF])
ET1 = bytes([130, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF])
DM1 = bytes([0x40, 0xFF, 110, 0x00, 0x00, 0x01, 0xFF, 0xFF])
SAMPLE_FIELDS = """
[vehicle]
tyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]

[fields]
speed_mps = { signal = "WHEEL_SPEED_FL", vss = "Vehicle.Speed", unit = "m/s", minimum = 0.0, maximum = 90.0, max_age_s = 1.0 }
"""


class Ask(NamedTuple):
    """A shared tool with the arguments that each takes; `title` tells calls of one tool apart."""

    tool: str
    ours: Mapping[str, Any]
    theirs: Mapping[str, Any] | None = None
    title: str = ""


class Asked(NamedTuple):
    """What both said, and how long each call took, in turns."""

    answers: dict[str, dict[str, Any]]
    ms: dict[str, dict[str, list[float]]]


class Car:
    """A simulated car on a virtual bus: drives, then only answers. Its frames are kept."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel, receive_own_messages=False)
        self._encoder, self._model, self._ecus = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel(), EcuBank(VIN)
        self._ended, self._lock = threading.Event(), threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.controls, self.talking, self.codes = Controls(speed_mps=0.0), True, tuple[str, ...]()
        self.recorded: list[can.Message] = []
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join(5.0)
        self._bus.shutdown()

    def _run(self) -> None:
        last_s = next_s = time.time()
        while not self._ended.is_set():
            message = self._bus.recv(max(0.0005, min(next_s - time.time(), 0.002)))
            now_s = time.time()
            state = replace(self._model.state, stored_codes=self.codes)
            now_ns = int(now_s * 1e9)
            if message is not None:
                self.recorded.append(message)
                shown = self._ecus.affect(state, now_ns)
                for answer in self._ecus.on_frame(from_message(message), shown, now_ns):
                    self._send(to_message(answer))
                if message.is_extended_id and message.arbitration_id >> 8 & 0x3FF00 == REQUEST_PGN:
                    self._group(int.from_bytes(message.data[:3], "little"))
            for answer in self._ecus.step(now_ns):
                self._send(to_message(answer))
            if now_s >= next_s:
                self._model.step(now_s - last_s, self.controls)
                last_s, next_s = now_s, now_s + 0.02
                if self.talking:
                    for frame in self._encoder.due(state, now_ns):
                        self._send(to_message(frame))
                    if int(now_s * 50) % 25 == 0:
                        for arbitration_id, payload in ((EEC1_ID, EEC1), (ET1_ID, ET1), (DM1_ID, DM1)):
                            self._send(_extended(arbitration_id, payload))

    def _group(self, pgn: int) -> None:
        for arbitration_id, payload in ((EEC1_ID, EEC1), (ET1_ID, ET1)):
            if arbitration_id >> 8 & 0x3FFFF == pgn:
                self._send(_extended(arbitration_id, payload))

    def _send(self, message: can.Message) -> None:
        message.timestamp = time.time()
        self._bus.send(message)
        self.recorded.append(message)


def _extended(arbitration_id: int, payload: bytes) -> can.Message:
    return can.Message(arbitration_id=arbitration_id, data=payload, is_extended_id=True)


class Both:
    """The two servers on one bus."""

    def __init__(self, node: Node, theirs: Any, folder: Path) -> None:
        self._node, self._theirs = node, theirs
        self._ours = make_server(node, Changes(), Drives(folder))

    def ask(self, asks: list[Ask], rounds: int = 1) -> Asked:
        """Every ask of both in turns, so that the machine's moods meet both alike; the last answers count."""
        return anyio.run(self._ask, asks, rounds)

    async def _ask(self, asks: list[Ask], rounds: int) -> Asked:
        found = Asked({}, {})
        async with Client(self._ours) as ours, Client(self._theirs) as theirs:
            for ask in asks:
                key = ask.title or ask.tool
                found.answers[key] = {}
                found.ms[key] = {"ours": [], "theirs": []}
                for _ in range(rounds):
                    for name, client, arguments in (
                        ("ours", ours, ask.ours),
                        ("theirs", theirs, ask.ours if ask.theirs is None else ask.theirs),
                    ):
                        started = time.perf_counter()
                        result = await client.call_tool(ask.tool, dict(arguments))
                        found.ms[key][name].append(1000.0 * (time.perf_counter() - started))
                        found.answers[key][name] = _content(result)
        return found

    def caught_up(self) -> None:
        """Once the bus is quiet: wait until both have counted the same frames, and no more come. Raises RuntimeError."""
        counts: list[tuple[int, int]] = []

        def still() -> bool:
            answer = self.ask([Ask("get_vehicle_snapshot", {})]).answers["get_vehicle_snapshot"]
            counts.append((answer["ours"]["frame_count"], answer["theirs"]["frame_count"]))
            return counts[-2:-1] == counts[-1:] and counts[-1][0] == counts[-1][1] > 0

        if not wait_settled(still, 20.0):
            raise RuntimeError(f"the two servers did not count the same frames: {counts[-1]}")

    def cleared(self, car: Car) -> dict[str, Any]:
        """Ours takes a grant and the confirmation of that command, which no client of MCP can give."""
        car.talking, car.controls = True, Controls(speed_mps=0.0)
        ask: list[tuple[str, dict[str, Any], float]] = [("uds_clear_dtcs", {}, 5000.0)]
        ours: Any = None

        def try_it() -> bool:
            nonlocal ours
            asked = re.search(
                r"confirmation must be '([^']+)'", self._node.client.call_all(ask, grant=_grant())[0].error
            )
            said = asked[1] if asked else ""
            ours = self._node.client.call_all(ask, grant=_grant(), confirmation=said)[0].result
            return bool(ours) and ours["status"] == "ok"

        wait_settled(try_it, 20.0)
        found = self.ask([Ask("uds_clear_dtcs", {})])
        return {"ours": ours, "ours without a grant": found.answers["uds_clear_dtcs"]["ours"],
                "theirs": found.answers["uds_clear_dtcs"]["theirs"]}  # fmt: skip


def _content(result: Any) -> Any:
    if result.is_error:
        return {"status": "failed", "message": " ".join(getattr(each, "text", "") for each in result.content)}
    content = result.structured_content
    return content["result"] if isinstance(content, dict) and set(content) == {"result"} else content


def _grant() -> str:
    now = datetime.now(UTC)
    given = Grant(
        grant_id="g-bench",
        vehicle="ego",
        capability="tool:uds_clear_dtcs",
        max_deceleration_mps2=1.0,
        max_duration_s=1.0,
        issued_at=(now - timedelta(hours=1)).isoformat(),
        expires_at=(now + timedelta(hours=1)).isoformat(),
    )
    return msgspec.json.encode(grants.sign_grant(given, KEY.private)).decode()


@contextmanager
def both(channel: str, folder: Path, profile: Path, dbc: Path) -> Iterator[Both]:
    """The two servers, hearing the same virtual bus and reading the same folder."""
    from peykan.server.mcp_server import create_app

    os.environ.update(
        PEYKAN_CAN_CHANNEL=channel, PEYKAN_DBC_PATH=str(dbc), PEYKAN_LOG_DIR=str(folder), PEYKAN_LOG_LEVEL="ERROR"
    )
    with bus() as b:
        config = CanConfig(
            profile=str(profile),
            buses=(BusConfig(interface="virtual", channel=channel),),
            raw_access=True,
            allow_vin=True,
            log_folder=str(folder),
            trusted_keys=(KEY.public,),
        )
        b.start(SERVICE, config)
        node = b.node("asking", ServiceConfig())
        node.watch_services()
        theirs = create_app()
        if not wait_settled(lambda: "get_log_signal" in node.catalogue(), 20.0):
            raise RuntimeError("the CAN service did not come up")
        yield Both(node, theirs, folder)


def _profile(folder: Path, *, sample: bool) -> tuple[Path, Path]:
    """Our profile of the simulated car or of Peykan's, with the J1939 groups beside its description; and that."""
    (folder / "j1939.dbc").write_text(J1939, encoding="utf-8")
    if sample:
        dbc = folder / "vehicle.dbc"
        dbc.write_bytes((files("peykan") / "data" / "vehicle.dbc").read_bytes())
        head = f'name = "sample"\n\n[buses.can0]\ndescription = ["{dbc}", "{folder}/j1939.dbc"]\nprotocol = "j1939"\n'
        text = head + '\n[ecus]\n0x7E0 = "engine"\n' + SAMPLE_FIELDS
    else:
        dbc = data("vehicles/sim/sim.dbc")
        text = data("vehicles/sim/profile.toml").read_text(encoding="utf-8")
        said = f'description = ["{dbc}", "{folder}/j1939.dbc"]\nprotocol = "j1939"'
        text = re.sub(r"max_age_s = [\d.]+", "max_age_s = 600.0", text.replace('description = "sim.dbc"', said))
    path = folder / ("sample.toml" if sample else "profile.toml")
    path.write_text(text, encoding="utf-8")
    return path, dbc


def simulated(folder: Path, rounds: int) -> Asked:
    """A car that drives, then stands and answers; then the log of that drive."""
    profile, dbc = _profile(folder, sample=False)
    with ExitStack() as stack:
        asking = stack.enter_context(both("beside-simulated", folder / "logs", profile, dbc))
        car = Car("beside-simulated")
        stack.callback(car.close)
        car.controls = Controls(speed_mps=10.0)
        threading.Event().wait(DRIVE_S)
        car.talking = False
        asking.caught_up()
        heard = asking.ask(_reading("VehicleSpeed", 0x100), rounds)
        car.codes = CODES
        answered = asking.ask(_requests(), rounds)
        with can.Logger(folder / "logs" / "drive.asc") as log:
            for message in sorted(car.recorded, key=lambda each: each.timestamp):
                log(message)
        logs = asking.ask(_logs("drive.asc", "VehicleSpeed"), max(1, rounds // 4))
        parts = [heard, answered, logs]
        cleared = asking.cleared(car)
    found = Asked({}, {})
    for part in parts:
        found.answers.update(part.answers)
        found.ms.update(part.ms)
    found.answers["uds_clear_dtcs"] = cleared
    return found


def recorded(folder: Path, rounds: int) -> Asked:
    """Peykan's own sample: played onto a bus that both hear, and read as a log."""
    profile, dbc = _profile(folder, sample=True)
    sample = folder / "logs" / "sample_drive.asc"
    sample.write_bytes((files("peykan") / "data" / "sample_drive.asc").read_bytes())
    with both("beside-recorded", folder / "logs", profile, dbc) as asking:
        with can.Bus(interface="virtual", channel="beside-recorded") as player, can.LogReader(sample) as reader:
            began_s, first_s = time.monotonic(), None
            for message in reader:
                first_s = message.timestamp if first_s is None else first_s
                due_s = (message.timestamp - first_s) / REPLAY_SPEED
                if due_s > DRIVE_S:
                    break
                threading.Event().wait(max(0.0, due_s - (time.monotonic() - began_s)))
                player.send(message)
        asking.caught_up()
        heard = asking.ask(_reading("ENGINE_SPEED", 0x100), rounds)
        logs = asking.ask(_logs("sample_drive.asc", "ENGINE_TEMP"), max(1, rounds // 4))
    return Asked(heard.answers | logs.answers, heard.ms | logs.ms)


def _reading(signal: str, arbitration_id: int) -> list[Ask]:
    window = {"duration_s": WINDOW_S}
    return [
        Ask("read_can_frames", window),
        Ask("filter_frames", {"arbitration_id": arbitration_id, **window}, title="filter_frames by id"),
        Ask("filter_frames", {"signal_name": signal, **window}, title="filter_frames by signal"),
        Ask("monitor_signal", {"signal_name": signal, **window}),
        Ask("get_vehicle_snapshot", {}),
        Ask("decode_can_frame", {"arbitration_id": "0x100", "data": [16, 39, 4, 0, 0, 0, 0, 0]}),
        Ask("decode_j1939_frame", {"arbitration_id": "0x0CF00400", "data": list(EEC1)}),
        Ask("list_j1939_pgns", {}),
        Ask("read_j1939_dtcs", window),
    ]


def _requests() -> list[Ask]:
    pids = {"coolant": 0x05, "engine speed": 0x0C, "vehicle speed": 0x0D, "fuel level": 0x2F}
    return [
        *(
            Ask("send_obd_request", {"service": 1, "pid": pid}, title=f"send_obd_request {n}")
            for n, pid in pids.items()
        ),
        Ask("send_obd_request", {"service": 3}, title="send_obd_request codes"),
        Ask("send_diagnostic_request", {"service_id": 0x22, "parameter_id": 0xF40D, "timeout_s": 0.5}),
        Ask("activate_fault_scenario", {"timeout_s": 0.5}),
        Ask("request_j1939_pgn", {"pgn": 0xF004, "timeout_s": 0.5}),
        Ask("read_vin", {}),
        Ask("uds_read_data", {"dids": ["0xF190", "0xF40C", "0xF40D"]}),
        Ask("uds_read_data", {"dids": ["0xF190", "0x0001"]}, title="uds_read_data with an unknown one"),
        Ask("uds_read_dtcs", {}),
        Ask("get_transmit_log", {"limit": 100}),
    ]


def _logs(path: str, signal: str) -> list[Ask]:
    return [
        Ask("list_can_logs", {}),
        Ask("analyze_can_log", {"path": path}),
        Ask("get_log_signal", {"path": path, "signal_name": signal, "max_points": 50}),
        Ask("analyze_can_log", {"path": "../profile.toml"}, title="analyze_can_log outside"),
    ]


def main() -> None:
    """Both buses, and which of their tools ours has."""
    logging.disable(logging.WARNING)
    rounds = int(sys.argv[1])
    parts: dict[str, Callable[[Path, int], Asked]] = {"simulated": simulated, "recorded": recorded}
    with tempfile.TemporaryDirectory() as name:
        (folder := Path(name)).joinpath("logs").mkdir()
        found = {part: measure(folder, rounds)._asdict() for part, measure in parts.items()}
    sys.stdout.write("\n" + json.dumps(found) + "\n")
    sys.stdout.flush()
    os._exit(0)  # Peykan's listeners never end


if __name__ == "__main__":
    main()
