"""A number on the bus becomes a number in the field's unit, or nothing at all."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.errors import ProfileError
from services.can.profiles.units import LINEAR, SPELLINGS, canonical, linear


@pytest.mark.parametrize(
    ("value", "bus_unit", "field_unit", "expected"),
    [
        (36.0, "km/h", "m/s", 10.0),
        (36.0, "Unit_KiloMeterPerHour", "m/s", 10.0),
        (10.0, "mph", "m/s", 4.4704),
        (1.0, "Unit_ForceOfGravi", "m/s2", 9.80665),
        (-50.0, "Unit_PerCentOfForceOfGravi", "m/s2", -4.903325),
        (180.0, "deg/s", "rad/s", math.pi),
        (60.0, "1/min", "rad/s", 2 * math.pi),
        (240.0, "kilopascal", "bar", 2.4),
        (32.0, "psi", "bar", 2.2063),
        (2500.0, "mbar", "bar", 2.5),
        (14.0, "degF", "degC", -10.0),
        (212.0, "F", "degC", 100.0),
        (-7.0, "\ufffdC", "degC", -7.0),
        (40.0, "Unit_PerCent", "share", 0.4),
    ],
)
def test_a_unit_is_converted_however_the_description_spells_it(
    value: float, bus_unit: str, field_unit: str, expected: float
) -> None:
    scale, offset = linear(bus_unit, field_unit)
    assert value * scale + offset == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("bus_unit", "field_unit"), [("furlong", "m/s"), ("", "m/s"), ("N", "bar"), ("degC", "m/s")])
def test_a_pair_that_the_table_does_not_hold_is_an_error_and_never_a_guess(bus_unit: str, field_unit: str) -> None:
    with pytest.raises(ProfileError, match="no conversion"):
        linear(bus_unit, field_unit)


def test_no_spelling_means_two_units() -> None:
    spellings = [spelling for unit, others in SPELLINGS.items() for spelling in (unit.lower(), *others)]
    assert len(spellings) == len(set(spellings))
    assert all(canonical(a) == a and b in SPELLINGS for a, b in LINEAR)


@given(st.sampled_from(sorted(LINEAR)), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_conversion_keeps_the_order_of_values(pair: tuple[str, str], low: float, high: float) -> None:
    scale, offset = linear(*pair)
    assert (low <= high) == (low * scale + offset <= high * scale + offset) or low == pytest.approx(high)
