"""Units, exactly."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.units import convert, from_mps, legal_limit, spoken_converted, to_mps

SPEEDS = st.floats(0.1, 300.0)


@given(SPEEDS, st.sampled_from(["km/h", "mph"]))
def test_there_and_back_is_the_same_speed(value: float, unit: str) -> None:
    assert from_mps(to_mps(value, unit), unit) == pytest.approx(value, rel=1e-12)  # type: ignore[arg-type]
    other = "mph" if unit == "km/h" else "km/h"
    assert convert(convert(value, unit, other), other, unit) == pytest.approx(value, rel=1e-12)  # type: ignore[arg-type]


@given(SPEEDS)
def test_a_mile_is_1609_344_m(value: float) -> None:
    assert convert(value, "mph", "km/h") == pytest.approx(value * 1.609344, rel=1e-12)


@pytest.mark.parametrize(("value", "unit", "mps"), [(36, "km/h", 10.0), (70, "mph", 31.2928), (50, "km/h", 50 / 3.6)])
def test_known_speeds(value: float, unit: str, mps: float) -> None:
    assert to_mps(value, unit) == pytest.approx(mps, abs=1e-9)  # type: ignore[arg-type]


def test_a_limit_keeps_its_posted_value() -> None:
    limit = legal_limit(50, "mph")
    assert (limit.value, limit.unit, limit.advisory) == (50, "mph", False)


@given(st.integers(5, 130))
def test_what_is_said_is_never_more_than_what_is_allowed(value: int) -> None:
    said = float(spoken_converted(value, "mph", "km/h").split()[0])
    assert convert(value, "mph", "km/h") - 1 < said <= convert(value, "mph", "km/h") + 1e-9
    assert spoken_converted(value, "km/h", "km/h") == f"{value} km/h"
