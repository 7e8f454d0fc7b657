"""The assessment: observations in, conditions out. Pure; the memory of what fell silent is passed in and out."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import msgspec

from proto.weather import Conditions
from services.weather import advice
from services.weather.memory import Memory, hold, hold_car
from services.weather.observations.observation import Observation, clean, trust
from services.weather.road import wind
from services.weather.road.car import Car, sane
from services.weather.road.grip import Grip, fuse
from services.weather.road.sight import sight_m
from services.weather.road.water_film import NO_RAIN_MM_H, WET_FROM_MM, film_claims, surely_at_least_mm

Risk = Literal["low", "moderate", "high", "severe", "unknown"]
SightRisk = Literal["low", "moderate", "high", "unknown"]

# (lower bound of mu, sight in m) that a level still needs.
_LEVELS: tuple[tuple[Risk, float, float], ...] = (
    ("low", 0.60, 1000.0),
    ("moderate", 0.38, 300.0),
    ("high", 0.18, 80.0),
)
MAX_CONFIDENCE = 0.9
# What must be known for full confidence: each row by any one of its fields.
_KNOWN: tuple[tuple[str, ...], ...] = (
    ("rain_mm_h", "snow_mm_h", "road"),
    ("film_mm", "road"),
    ("visibility_m",),
    ("road_c", "air_c"),
)


class Assessed(msgspec.Struct, frozen=True, kw_only=True):
    """Conditions, and what the next assessment must remember."""

    conditions: Conditions
    memory: Memory


class _Picture(NamedTuple):
    """What all sources together leave, at the car's speed and at the speed that advice is worked out for."""

    grip: Grip
    sight: float | None
    gust: float | None
    held: tuple[str, ...]


def assess(
    raw: Sequence[Observation], car: Car, memory: Memory, now_ns: int, limit_mps: float | None = None
) -> Assessed:
    """The conditions at one instant."""
    memory = memory.by(now_ns)
    pieces, held = hold([clean(each) for each in raw], memory, now_ns)
    known = sane(car)
    driven = hold_car(known, memory, now_ns)
    wet_mm = max((each.warn for each in film_claims(pieces, now_ns, drying=False)), default=0.0)
    kept = _remember(memory, pieces, wet_mm, known, driven, now_ns)
    reference = advice.reference_speed_mps(driven.speed_mps, limit_mps)
    fastest = max(reference, driven.speed)
    picture = _Picture(
        grip=fuse(pieces, driven, fastest, now_ns, drying=kept.drying(now_ns), left_mm=kept.left_mm(now_ns)),
        sight=sight_m(pieces, fastest, wet_mm),
        gust=wind.gust_mps(pieces),
        held=held,
    )
    if picture.grip.contradiction:
        kept = msgspec.structs.replace(kept, contradiction_ns=now_ns)
    confidence = _confidence(pieces, now_ns) * (0.5 if kept.doubted(now_ns) else 1.0)
    return Assessed(conditions=_conditions(pieces, picture, driven, reference, round(confidence, 3)), memory=kept)


def _remember(
    memory: Memory,
    pieces: tuple[Observation, ...],
    wet_mm: float,
    car: Car,
    driven: Car,
    now_ns: int,
) -> Memory:
    left_mm = memory.left_mm(now_ns)
    lies = any(surely_at_least_mm(each) >= WET_FROM_MM for each in pieces) and wet_mm >= left_mm
    return msgspec.structs.replace(
        memory,
        pieces=pieces,
        wet_ns=now_ns if wet_mm >= WET_FROM_MM else memory.wet_ns,
        lay_mm=wet_mm if lies else memory.lay_mm,
        lay_ns=now_ns if lies else memory.lay_ns,
        since_ns=memory.since_ns if memory.since_ns is not None else now_ns,
        car=driven,
        speed_ns=now_ns if car.speed_mps is not None else memory.speed_ns,
    )


def _conditions(
    pieces: Sequence[Observation], picture: _Picture, car: Car, reference_mps: float, confidence: float
) -> Conditions:
    grip, sight = picture.grip, picture.sight
    mu_low = round(grip.mu.low, 4)
    planned = min(mu_low, round(grip.planned_low, 4))
    road = advice.Road(planned, sight, wind.wind_speed_mps(planned, picture.gust), car.brakes)
    told = advice.advise(reference_mps, road)
    nothing = not grip.sources and sight is None
    return Conditions(
        precipitation=_precipitation(pieces),
        rain_mm_h=_most(pieces, "rain_mm_h"),
        visibility_m=sight,
        mu_low=mu_low,
        mu_high=max(mu_low, round(grip.mu.high, 4)),
        risk_level="unknown" if nothing else _risk(mu_low, sight),
        speed_factor=told.speed_factor,
        following_factor=told.following_factor,
        confidence=confidence,
        wet=grip.wet,
        visibility_risk=_sight_risk(sight),
        reason=_reason(picture, told, reference_mps),
        sources=grip.sources,
        safe_speed_mps=told.safe_speed_mps,
        reference_speed_mps=reference_mps,
        stopping_m=told.stopping_m,
        usual_stopping_m=told.usual_m,
        bounded_by=told.bounded_by,
        gust_mps=picture.gust,
        disagree=grip.contradiction,
    )


def _most(pieces: Sequence[Observation], name: str) -> float | None:
    """The middle of the worst interval that any source gives."""
    found = [(each.low + each.high) / 2.0 for piece in pieces if (each := getattr(piece, name)) is not None]
    return max(found, default=None)


def _precipitation(pieces: Sequence[Observation]) -> Literal["none", "rain", "snow", "unknown"]:
    snow, rain = _most(pieces, "snow_mm_h"), _most(pieces, "rain_mm_h")
    if snow is not None and snow > 0.0:
        return "snow"
    if rain is None:
        return "unknown"
    surely = any(each.rain_mm_h is not None and each.rain_mm_h.low > NO_RAIN_MM_H for each in pieces)
    return "rain" if surely else "none" if rain <= NO_RAIN_MM_H else "unknown"


def _risk(mu_low: float, sight: float | None) -> Risk:
    for level, mu, seen_m in _LEVELS:
        if mu_low >= mu and (sight is None or sight >= seen_m):
            return level
    return "severe"


def _sight_risk(sight: float | None) -> SightRisk:
    if sight is None:
        return "unknown"
    return "low" if sight >= 1000.0 else "moderate" if sight >= 300.0 else "high"


def _confidence(pieces: Sequence[Observation], now_ns: int) -> float:
    """How much is known: the mean over the quantities of the surest source's trust. The interval's width already says
    what is left open.
    """
    sure = [
        max((trust(each, now_ns) for each in pieces if any(getattr(each, f) is not None for f in names)), default=0.0)
        for names in _KNOWN
    ]
    return MAX_CONFIDENCE * sum(sure) / len(sure)


def _reason(picture: _Picture, told: advice.Advice, reference_mps: float) -> str:
    grip, sight = picture.grip, picture.sight
    parts = [*grip.notes, f"grip {grip.mu.low:.2f} to {grip.mu.high:.2f}"]
    if sight is not None and sight < 2000.0:
        parts.append(f"sight {sight:.0f} m")
    if grip.contradiction:
        parts.append("sources disagree")
    if picture.held:
        parts.append("no longer reported: " + ", ".join(sorted(set(picture.held))))
    if told.stopping_m > told.usual_m * 1.05 or told.bounded_by == "sight":
        parts.append(
            f"stopping from {reference_mps * 3.6:.0f} km/h takes up to {told.stopping_m:.0f} m"
            f" instead of {told.usual_m:.0f} m"
        )
    if told.bounded_by == "wind":
        parts.append(f"gusts of {picture.gust:.0f} m/s push the car")
    return "; ".join(parts)
