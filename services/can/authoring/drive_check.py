"""A profile against a recorded drive: what each field shows, and whether signs and units agree with one another."""

import statistics
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import msgspec

from proto.sensors import CanFrame
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile
from services.can.signals.board import Board

NS = 1_000_000_000
GRID_NS = NS // 10
MIN_PAIRS = 50
"""Fewer moments than this (5 s) prove nothing about a sign."""
AGREE, OPPOSE = 0.5, -0.5
RATIO_LOW, RATIO_HIGH = 0.8, 1.25
"""One field over what another makes of it: beyond this a unit or a factor is wrong."""


class Shown(NamedTuple):
    """One field over the drive. `rejected`: reason -> samples."""

    samples: int
    rejected: Mapping[str, int]
    hz: float
    low: float | None
    high: float | None


class Agreement(NamedTuple):
    """A field against what others say of it: correlation, and how many of the other make one of it."""

    field: str
    against: str
    correlation: float
    ratio: float

    @property
    def verdict(self) -> str:
        """In words."""
        if self.correlation <= OPPOSE:
            return "OPPOSITE SIGN"
        if self.correlation < AGREE:
            return "unclear"
        return "agrees" if RATIO_LOW <= self.ratio <= RATIO_HIGH else f"UNIT OR FACTOR: {self.ratio:.2g} times too much"


class DriveReport(msgspec.Struct, frozen=True, kw_only=True):
    """What a drive showed."""

    seconds: float
    frames: int
    fields: dict[str, Shown]
    agreements: list[Agreement]


class _Tally:
    def __init__(self) -> None:
        self.good: list[float] = []
        self.rejected: Counter[str] = Counter()


def check_drive(
    profile: Profile, descriptions: Mapping[str, Dbc], frames: Iterable[tuple[str, CanFrame]]
) -> DriveReport:
    """Feed (bus, frame) in order through the board, as the service does."""
    board = Board(descriptions, profile)
    tallies: dict[str, _Tally] = defaultdict(_Tally)
    feeds = _feeds(profile, descriptions)
    rows: list[dict[str, float]] = []
    first_ns = last_ns = next_ns = count = 0
    for bus, frame in frames:
        count, last_ns = count + 1, frame.stamp_ns
        first_ns = first_ns or last_ns
        board.ingest((frame,), last_ns, bus)
        for name in feeds.get((bus, frame.extended, frame.arbitration_id), ()):
            _note(tallies[name], board, name, last_ns)
        if last_ns >= next_ns:
            rows.append({name: v for name in board.fields if (v := board.read(name, last_ns).value) is not None})
            next_ns = last_ns + GRID_NS
    seconds = max((last_ns - first_ns) / NS, 0.0)
    shown = {name: _shown(tallies[name], seconds) for name in board.fields}
    return DriveReport(seconds=seconds, frames=count, fields=shown, agreements=agreements(rows))


def _feeds(profile: Profile, descriptions: Mapping[str, Dbc]) -> dict[tuple[str, bool, int], list[str]]:
    found: dict[tuple[str, bool, int], list[str]] = defaultdict(list)
    for name, rule in profile.fields.items():
        bus = profile.bus_of(rule)
        message, _ = descriptions[bus].signal(rule.signals[0], rule.message)
        found[bus, bool(message.is_extended_frame), int(message.frame_id)].append(name)
    return found


def _note(tally: _Tally, board: Board, name: str, now_ns: int) -> None:
    reading = board.read(name, now_ns)
    if reading.value is not None and reading.stamp_ns == now_ns:
        tally.good.append(reading.value)
    elif reading.stamp_ns == now_ns:
        tally.rejected[reading.reason] += 1


def _shown(tally: _Tally, seconds: float) -> Shown:
    samples = len(tally.good) + tally.rejected.total()
    return Shown(
        samples=samples,
        rejected=dict(tally.rejected.most_common()),
        hz=samples / seconds if seconds > 0 else 0.0,
        low=min(tally.good, default=None),
        high=max(tally.good, default=None),
    )


def agreements(rows: list[dict[str, float]]) -> list[Agreement]:
    """Fields against what others say of them, over moments 0.1 s apart."""
    wheels = [(name, "speed_mps", _pairs(rows, name, "speed_mps")) for name in sorted(_names(rows)) if "wheel_" in name]
    curves = [(row["yaw_rate_radps"] * row["speed_mps"]) if {"yaw_rate_radps", "speed_mps"} <= row.keys() else None
              for row in rows]  # fmt: skip
    return [
        _agreement(field, against, pairs)
        for field, against, pairs in (
            ("acceleration_mps2", "change of speed_mps", _with(rows, "acceleration_mps2", _slopes(rows))),
            ("lateral_acceleration_mps2", "yaw rate times speed", _with(rows, "lateral_acceleration_mps2", curves)),
            ("yaw_rate_radps", "steering_angle_rad", _pairs(rows, "yaw_rate_radps", "steering_angle_rad")),
            *wheels,
        )
        if len(pairs) >= MIN_PAIRS and _varies(pairs)
    ]


def _slopes(rows: list[dict[str, float]]) -> list[float | None]:
    """m/s2 over the second around each moment."""
    speeds = [row.get("speed_mps") for row in rows]
    return [
        None if before is None or after is None else after - before
        for before, after in zip([None] * 5 + speeds, speeds[5:] + [None] * 5, strict=False)
    ][: len(rows)]


def _names(rows: list[dict[str, float]]) -> set[str]:
    return {name for row in rows for name in row}


def _with(rows: list[dict[str, float]], field: str, other: list[float | None]) -> list[tuple[float, float]]:
    return [(row[field], each) for row, each in zip(rows, other, strict=False) if field in row and each is not None]


def _pairs(rows: list[dict[str, float]], field: str, other: str) -> list[tuple[float, float]]:
    return _with(rows, field, [row.get(other) for row in rows])


def _varies(pairs: list[tuple[float, float]]) -> bool:
    return all(len({round(each[side], 6) for each in pairs}) > 2 for side in (0, 1))


def _agreement(field: str, against: str, pairs: list[tuple[float, float]]) -> Agreement:
    own, other = [each[0] for each in pairs], [each[1] for each in pairs]
    correlation = statistics.correlation(own, other)
    ratio = statistics.linear_regression(other, own, proportional=True).slope
    alone = against == "steering_angle_rad"  # grows with speed: only its sign tells
    return Agreement(field, against, correlation, 1.0 if alone else ratio)
