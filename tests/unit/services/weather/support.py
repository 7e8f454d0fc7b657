"""Observations for the tests of Weather, ordinary ones and any that a source might make."""

from typing import Any

import msgspec
from hypothesis import strategies as st

from proto.weather import Conditions
from services.weather.assess import assess
from services.weather.memory import Memory
from services.weather.observations.observation import LIMITS, NS, Interval, Observation
from services.weather.road.car import Car

NOW = 10_000 * NS
WATCHED = Memory(since_ns=NOW - 5_000 * NS)
"""Of a drive that is long under way on a dry road."""
DRIVING = Car(speed_mps=14.0, tyre_low=0.0)
CLEAR = Observation(
    source="station",
    stamp_ns=NOW,
    confidence=0.95,
    rain_mm_h=Interval(0.0, 0.0),
    snow_mm_h=Interval(0.0, 0.0),
    film_mm=Interval(0.0, 0.0),
    visibility_m=Interval(9000.0, 11_000.0),
    air_c=Interval(17.5, 18.5),
    road_c=Interval(21.0, 23.0),
)
RAIN = msgspec.structs.replace(
    CLEAR,
    rain_mm_h=Interval(16.0, 24.0),
    film_mm=Interval(0.32, 0.48),
    visibility_m=Interval(1200.0, 1800.0),
    air_c=Interval(11.5, 12.5),
    road_c=Interval(11.0, 13.0),
)
COLD = msgspec.structs.replace(CLEAR, air_c=Interval(-3.5, -2.5), road_c=Interval(-4.0, -2.0))


def changed(seen: Observation, **changes: Any) -> Observation:
    return msgspec.structs.replace(seen, **changes)


def conditions(
    *observations: Observation, car: Car = DRIVING, memory: Memory = WATCHED, limit_mps: float | None = None
) -> Conditions:
    return assess(observations, car, memory, NOW, limit_mps).conditions


def no_less_careful(answer: Conditions, than: Conditions) -> None:
    """In each number that somebody drives by."""
    assert answer.mu_low <= than.mu_low + 1e-9
    assert answer.speed_factor <= than.speed_factor + 1e-9
    assert answer.following_factor >= than.following_factor - 1e-9
    if than.safe_speed_mps is not None:
        assert answer.safe_speed_mps is not None
        assert answer.safe_speed_mps <= than.safe_speed_mps + 1e-9


BAD_END = {"visibility_m": "low", "air_c": "low", "road_c": "low", "mu": "low"}
"""Where less is worse; elsewhere more is."""
_SPANS = {
    "rain_mm_h": (0.0, 60.0),
    "snow_mm_h": (0.0, 8.0),
    "film_mm": (0.0, 4.0),
    "visibility_m": (5.0, 20_000.0),
    "air_c": (-15.0, 30.0),
    "road_c": (-15.0, 40.0),
    "dew_point_c": (-15.0, 20.0),
    "humidity": (0.0, 1.0),
    "wind_mps": (0.0, 30.0),
    "gust_mps": (0.0, 40.0),
    "mu": (0.05, 1.0),
}
assert _SPANS.keys() == LIMITS.keys()


def _interval(low: float, high: float) -> st.SearchStrategy[Interval]:
    ends = st.just(low) | st.floats(low, high)
    return st.tuples(ends, ends).map(lambda pair: Interval(min(pair), max(pair)))


ROADS = ("dry", "damp", "wet", "flooded", "slush", "snow", "packed_snow", "frost", "ice")


def observation(source: str) -> st.SearchStrategy[Observation]:
    fields: dict[str, st.SearchStrategy[Any]] = {
        name: st.none() | _interval(low, high) for name, (low, high) in _SPANS.items()
    }
    return st.builds(
        Observation,
        source=st.just(source),
        stamp_ns=st.floats(0, 300).map(lambda age_s: NOW - int(age_s * NS)) | st.just(NOW),
        confidence=st.sampled_from([0.0, 0.5, 0.9, 0.97, 1.0]) | st.floats(0, 1),
        halves_s=st.sampled_from([5.0, 60.0, 3600.0]),
        road=st.none() | st.sampled_from(ROADS),
        bridge=st.none() | st.booleans(),
        **fields,
    )


OBSERVATIONS = st.integers(0, 4).flatmap(lambda count: st.tuples(*(observation(f"source {n}") for n in range(count))))
CARS = st.builds(
    Car,
    speed_mps=st.none() | st.floats(0, 55),
    tyre_low=st.none() | st.floats(0, 1),
    tread_mm=st.none() | st.floats(1, 8),
    brake_envelope=st.none() | st.floats(0.1, 1),
)
MEMORIES = st.sampled_from([Memory(), WATCHED, Memory(wet_ns=NOW - 60 * NS, since_ns=NOW - 5_000 * NS)])
