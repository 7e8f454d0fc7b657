"""What was known before: a source that falls silent is held for a while, and grows old; water that lay dries slowly."""

import math
from collections.abc import Mapping, Sequence

import msgspec

from services.weather.observations.observation import FIELDS, NS, Observation
from services.weather.road import friction
from services.weather.road.car import UNKNOWN_SPEED_MPS, Car

DRYING_S = 1200.0
"""A road counts as possibly wet so long after it was last known to be wet, unless its film is measured."""
DRIES_S = 240.0
"""A film falls to 1/e in this time at best: sun and wind (ours)."""
STANDS_S = 15.0
"""What is deeper than a film of rain stands in ruts and dips and stays behind: counted on for so long, as more may follow (ours)."""
DOUBT_S = 60.0
"""Sources that disagreed keep the confidence low for so long: one of them falling silent settles nothing."""
HELD_SPEED_S = 10.0

# How long a field that falls silent is held. Held, it warns in full and reassures less and less.
HOLD_S: Mapping[str, float] = {
    "rain_mm_h": 900.0,
    "snow_mm_h": 1800.0,
    "film_mm": 900.0,
    "visibility_m": 300.0,
    "air_c": 1800.0,
    "road_c": 1800.0,
    "dew_point_c": 1800.0,
    "humidity": 1800.0,
    "wind_mps": 900.0,
    "gust_mps": 900.0,
    "mu": 60.0,
    "road": 300.0,
    "bridge": 10.0,
}


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """The pieces of the last observations, newest first per source; when the road was last wet, since when it is
    watched, when sources last disagreed; the car as it last was."""

    pieces: tuple[Observation, ...] = ()
    wet_ns: int | None = None
    lay_mm: float = 0.0
    """The film that was vouched for at `lay_ns`."""
    lay_ns: int = 0
    since_ns: int | None = None
    contradiction_ns: int | None = None
    car: Car = Car()
    speed_ns: int = 0

    def by(self, now_ns: int) -> "Memory":
        """The memory after the clock fell back: what it dates ahead of the clock counts as of now, not of long ago."""
        ahead = [name for name in _STAMPS if (stamp := getattr(self, name)) is not None and stamp > now_ns]
        return msgspec.structs.replace(self, **dict.fromkeys(ahead, now_ns)) if ahead else self

    def drying(self, now_ns: int) -> bool:
        """Whether it rained lately, or the weather was not watched long enough to know that it did not."""
        began = [stamp for stamp in (self.wet_ns, self.since_ns) if stamp is not None]
        return self.since_ns is None or any(now_ns - stamp <= DRYING_S * NS for stamp in began)

    def left_mm(self, now_ns: int) -> float:
        """What is counted on of the film that lay: it dries slowly; what stood deeper was of a place, and is soon behind."""
        film_mm, gone_s = min(self.lay_mm, friction.UNKNOWN_FILM_MM), max(0, now_ns - self.lay_ns) / NS
        return film_mm * math.exp(-gone_s / DRIES_S) + (self.lay_mm - film_mm) * math.exp(-gone_s / STANDS_S)

    def doubted(self, now_ns: int) -> bool:
        """Whether sources disagreed lately."""
        return self.contradiction_ns is not None and now_ns - self.contradiction_ns <= DOUBT_S * NS


_STAMPS = ("wet_ns", "lay_ns", "since_ns", "contradiction_ns", "speed_ns")


def hold(
    observations: Sequence[Observation], memory: Memory, now_ns: int
) -> tuple[tuple[Observation, ...], tuple[str, ...]]:
    """The observations with what fell silent since: (all pieces, names of what is held)."""
    told = {each.source: {name for name in FIELDS if getattr(each, name) is not None} for each in observations}
    pieces, held = list(observations), []
    for piece in memory.pieces:
        known = told.setdefault(piece.source, set())
        silent = [name for name in FIELDS if name not in known and _holds(piece, name, now_ns)]
        if silent:
            known.update(silent)
            pieces.append(msgspec.structs.replace(piece, **{name: None for name in FIELDS if name not in silent}))
            held += [f"{piece.source}: {name.rsplit('_', 1)[0].replace('_', ' ')}" for name in silent]
    return tuple(pieces), tuple(held)


def _holds(piece: Observation, name: str, now_ns: int) -> bool:
    return getattr(piece, name) is not None and now_ns - piece.stamp_ns <= HOLD_S[name] * NS


def hold_car(car: Car, memory: Memory, now_ns: int) -> Car:
    """The car with what fell silent as it last was; tyres and brakes do not mend themselves."""
    before, speed = memory.car, car.speed_mps
    if speed is None and before.speed_mps is not None and now_ns - memory.speed_ns <= HELD_SPEED_S * NS:
        speed = max(before.speed_mps, UNKNOWN_SPEED_MPS)
    return Car(
        speed_mps=speed,
        tyre_low=before.tyre_low if car.tyre_low is None else car.tyre_low,
        tread_mm=before.tread_mm if car.tread_mm is None else car.tread_mm,
        brake_envelope=before.brake_envelope if car.brake_envelope is None else car.brake_envelope,
    )
