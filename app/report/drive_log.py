"""The log of a drive as the report needs it, read once from its first message to its last."""

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec

from app.pictures import jpeg_of
from app.report.ticks import Inputs, Tick
from domain.hearing import Hearing
from drivemcp.errors import MALFORMED
from proto import topics
from proto.perception import Boxes
from services.logger.format.reader import Logged, messages
from services.logger.writing.withheld import TOPIC as WITHHELD

CAMERA = "sensor/camera/front"
HELD = 40
"""Pictures and boxes of the last seconds: a tick comes after the picture that it was decided on."""
MOST_PICTURES = 300
MOST_LINES = 40
LONGEST_STEP_S = 1.0


class Health(msgspec.Struct, frozen=True):
    """What a service said of itself."""

    service: str = ""
    rss_mb: float = 0.0
    calls_served: int = 0
    calls_refused: int = 0
    dropped: int = 0
    detail: dict[str, str] = {}


class Scenario(msgspec.Struct, frozen=True):
    """Which scenario or recording it was."""

    scenario: str = ""
    seed: int = 0
    problem: str = ""


class Spoken(msgspec.Struct, frozen=True, kw_only=True):
    """A message to the driver: its tick, the trace as logged, and the picture that was decided on, if the log has it."""

    tick: Tick
    trace: bytes
    jpeg: bytes = b""
    boxes: Boxes | None = None


@dataclass(slots=True)
class DriveLog:
    """All that the page shows of the log itself."""

    files: tuple[Path, ...]
    scenario: Scenario = field(default_factory=Scenario)
    ticks: list[Tick] = field(default_factory=list)
    """Without what only messages need: see `slim`."""
    hearing: Hearing = field(default_factory=Hearing)
    spoken: list[Spoken] = field(default_factory=list)
    health: dict[str, Health] = field(default_factory=dict)
    highest_rss_mb: dict[str, float] = field(default_factory=dict)
    calls: Counter[tuple[str, str]] = field(default_factory=Counter)
    """By tool and status."""
    troubles: list[str] = field(default_factory=list)
    """Warnings and errors of the services, the first of them."""
    more_troubles: int = 0
    withheld: int = 0
    """Messages that the log left out for privacy."""
    unread: Counter[str] = field(default_factory=Counter)
    """Messages by topic that this version cannot read."""

    @property
    def seconds(self) -> float:
        """From the first tick to the last."""
        return (self.ticks[-1].stamp_ns - self.ticks[0].stamp_ns) / 1e9 if self.ticks else 0.0

    @property
    def distance_m(self) -> float:
        """By the speeds of the ticks; over a gap of the log no distance is reckoned."""
        return sum(_driven_m(before, after) for before, after in pairwise(self.ticks))


def _driven_m(before: Tick, after: Tick) -> float:
    step_s = (after.stamp_ns - before.stamp_ns) / 1e9
    if before.speed_mps is None or not 0.0 < step_s <= LONGEST_STEP_S:
        return 0.0
    return before.speed_mps * step_s


def read_drive(files: Sequence[Path]) -> DriveLog:
    """Reads the files in their order. Raises UserError for what is no log, OSError for what cannot be read."""
    log, pictures, boxes = DriveLog(tuple(files)), _Held(), _Held()
    for logged in _all(files):
        try:
            _take(log, logged, pictures, boxes)
        except MALFORMED:
            log.unread[logged.name] += 1
    return log


def _all(files: Sequence[Path]) -> Iterator[Logged]:
    for path in files:
        yield from messages(path)


class _Held:
    """The last messages of a kind, by stamp."""

    def __init__(self) -> None:
        self._last: deque[tuple[int, Any]] = deque(maxlen=HELD)

    def add(self, stamp_ns: int, what: Any) -> None:
        self._last.append((stamp_ns, what))

    def at(self, stamp_ns: int) -> Any | None:
        """That of this stamp; else the newest before it."""
        earlier = [(at, what) for at, what in self._last if at <= stamp_ns]
        return max(earlier, key=lambda row: row[0])[1] if earlier else None


_TICKS = msgspec.json.Decoder(Tick)
_BOXES = msgspec.json.Decoder(Boxes)
_HEALTH = msgspec.json.Decoder(Health)
_SCENARIO = msgspec.json.Decoder(Scenario)


class _Record(msgspec.Struct, frozen=True):
    tool: str = ""
    side: str = ""
    status: str = ""


class _Records(msgspec.Struct, frozen=True):
    records: tuple[_Record, ...] = ()


class _Withheld(msgspec.Struct, frozen=True):
    count: int = 0


_WITHHELD = msgspec.json.Decoder(_Withheld)
_CALLS = msgspec.json.Decoder(_Records)


def _take(log: DriveLog, logged: Logged, pictures: _Held, boxes: _Held) -> None:
    name = logged.name
    if name == CAMERA:
        pictures.add(logged.stamp_ns, logged.data)
    elif name == topics.BOXES.name:
        if (found := _BOXES.decode(logged.data)).camera == "front":
            boxes.add(logged.stamp_ns, found)
    elif name == topics.TRACE.name:
        _add_tick(log, logged.data, pictures, boxes)
    elif name == WITHHELD:
        log.withheld += _WITHHELD.decode(logged.data).count
    elif name.startswith("health/"):
        health = _HEALTH.decode(logged.data)
        log.health[health.service] = health
        log.highest_rss_mb[health.service] = max(log.highest_rss_mb.get(health.service, 0.0), health.rss_mb)
    elif name.startswith("calls/"):
        log.calls.update(
            (each.tool, each.status) for each in _CALLS.decode(logged.data).records if each.side == "caller"
        )
    elif name == topics.SCENARIO.name:
        log.scenario = _SCENARIO.decode(logged.data)
    elif name.startswith("log/"):
        _add_trouble(log, name.removeprefix("log/"), logged.data)


def _add_tick(log: DriveLog, trace: bytes, pictures: _Held, boxes: _Held) -> None:
    tick = _TICKS.decode(trace)
    if log.hearing.notes(tick.advisory, tick.stamp_ns):
        shown = len(log.spoken) < MOST_PICTURES
        at_ns = tick.advisory.snapshot_stamp_ns or tick.stamp_ns
        jpeg = jpeg_of(pictures.at(at_ns) or b"") if shown else b""
        log.spoken.append(Spoken(tick=tick, trace=trace, jpeg=jpeg, boxes=boxes.at(at_ns) if shown else None))
    log.ticks.append(slim(tick))


def slim(tick: Tick) -> Tick:
    """What the timeline and the counts need: thousands of ticks are kept."""
    return Tick(
        tick=tick.tick,
        stamp_ns=tick.stamp_ns,
        inputs=Inputs(ego=tick.inputs.ego),
        decision=tick.decision,
        advisory=msgspec.structs.replace(tick.advisory, justification=""),
        versions=tick.versions,
    )


def _add_trouble(log: DriveLog, service: str, data: bytes) -> None:
    from foxglove_schemas_protobuf.Log_pb2 import Log

    line = Log()
    line.ParseFromString(data)
    if line.level < Log.WARNING:
        return
    if len(log.troubles) < MOST_LINES:
        log.troubles.append(f"{service}: {line.message}")
    else:
        log.more_troubles += 1
