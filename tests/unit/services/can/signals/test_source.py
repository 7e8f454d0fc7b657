"""Several signals, separate signs and named values make one field, as the profile says."""

import pytest
from cantools.database.can import Database
from hypothesis import given
from hypothesis import strategies as st

from services.can.errors import ProfileError
from services.can.profiles.profile import FieldRule
from services.can.signals.source import source, usable

_DATABASE = Database()
_DATABASE.add_dbc_string(
    """VERSION ""
BU_: A
BO_ 1 M: 8 A
 SG_ Left : 0|16@1+ (0.01,0) [0|300] "km/h" A
 SG_ Right : 16|16@1+ (0.01,0) [0|300] "km/h" A
 SG_ Minus : 32|1@1+ (1,0) [0|1] "" A
 SG_ Stage : 33|3@1+ (1,0) [0|7] "" A
 SG_ Quality : 36|2@1+ (1,0) [0|3] "" A
 SG_ Low : 40|1@1+ (1,0) [0|1] "" A
 SG_ High : 41|1@1+ (1,0) [0|1] "" A
VAL_ 1 Stage 0 "OFF" 1 "INT" 5 "FAST" ;
VAL_ 1 Quality 3 "OK" 0 "BAD" ;
"""
)
MESSAGE = _DATABASE.get_message_by_name("M")


def _read(rule: FieldRule, **values: float) -> float | None:
    every: dict[str, float] = {signal.name: 0.0 for signal in MESSAGE.signals}
    return source(rule, MESSAGE)(every | values)


@given(st.floats(0.0, 300.0), st.floats(0.0, 300.0))
def test_two_wheels_make_one_speed(left: float, right: float) -> None:
    both = FieldRule(signal=("Left", "Right"), unit="m/s")
    assert _read(both, Left=left, Right=right) == pytest.approx((left + right) / 7.2)
    fastest = FieldRule(signal=("Left", "Right"), unit="m/s", combine="max")
    assert _read(fastest, Left=left, Right=right) == pytest.approx(max(left, right) / 3.6)


@given(st.floats(0.0, 300.0))
def test_a_sign_may_stand_apart_from_its_amount(amount: float) -> None:
    rule = FieldRule(signal="Left", unit="m/s", negative_if="Minus")
    assert _read(rule, Left=amount, Minus=0) == pytest.approx(amount / 3.6)
    assert _read(rule, Left=amount, Minus=1) == pytest.approx(-amount / 3.6)


def test_named_and_raw_values_become_the_fields_own_and_others_are_not_believed() -> None:
    rule = FieldRule(signal="Stage", values={"OFF": 0, "INT": 1, "5": 3})
    assert [_read(rule, Stage=raw) for raw in (0, 1, 5, 2)] == [0, 1, 3, None]
    flag = FieldRule(signal="Stage", values={"OFF": 0}, otherwise=1)
    assert [_read(flag, Stage=raw) for raw in (0, 1, 7)] == [0, 1, 1]


def test_lamps_of_several_signals_count_by_their_weight() -> None:
    rule = FieldRule(signal=("Low", "High"), weights=(2.0, 3.0), combine="max")
    assert [_read(rule, Low=low, High=high) for low, high in ((0, 0), (1, 0), (1, 1))] == [0, 2, 3]


def test_the_sender_vouches_for_a_value_or_it_is_not_used() -> None:
    named = usable(FieldRule(signal="Left", valid_if="Quality", valid_values=("OK",)), MESSAGE)
    assert [named({"Quality": quality}) for quality in (0, 1, 3)] == [False, False, True]
    inverted = usable(FieldRule(signal="Left", valid_if="Minus", valid_values=(0,)), MESSAGE)
    assert [inverted({"Minus": bit}) for bit in (0, 1)] == [True, False]
    assert usable(FieldRule(signal="Left", valid_if="Minus"), MESSAGE)({"Minus": 1})
    assert usable(FieldRule(signal="Left"), MESSAGE)({})


@pytest.mark.parametrize(
    ("rule", "complaint"),
    [
        (FieldRule(signal="Speed", unit="m/s"), "Speed is not in message M"),
        (FieldRule(signal="Left", unit="m/s", counter="Count"), "Count is not in message M"),
        (FieldRule(signal="Stage", values={"SLOW": 1}), "Stage: no value 'SLOW'; named are OFF, INT, FAST"),
        (FieldRule(signal="Left", unit="bar"), "Left: no conversion from 'km/h' to 'bar'"),
    ],
)
def test_what_the_message_has_not_is_an_error_that_names_it(rule: FieldRule, complaint: str) -> None:
    with pytest.raises(ProfileError, match=complaint):
        source(rule, MESSAGE)
