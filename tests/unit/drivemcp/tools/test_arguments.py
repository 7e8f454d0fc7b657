"""Arguments of a call: strict where a mistake hides, lenient where nothing is meant by it."""

import json
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.tools.arguments import ArgumentDecoder, ArgumentsRefused
from drivemcp.tools.definition import define
from drivemcp.tools.refusal import impossible


class Wheel(msgspec.Struct, frozen=True, kw_only=True):
    """A wheel."""

    place: Literal["left", "right"]
    turns: int = 0


class Axle(msgspec.Struct, frozen=True, kw_only=True):
    """Two wheels."""

    wheels: tuple[Wheel, ...] = ()
    load_kg: Annotated[float, msgspec.Meta(ge=0.0, description="load, kg", examples=[500.0])] | None = None


def weigh(axle: Axle, count: int = 1, spare: Wheel | None = None, label: int | str = "") -> dict[str, int]:
    """Weigh an axle."""
    return {"count": count}


DECODER = ArgumentDecoder(define(weigh, server="scales", deadline_ms=10))


def decoded(arguments: Any) -> Any:
    return DECODER.decode(json.dumps(arguments).encode())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"axle": {"weels": []}}, '[field: axle.weels] [do: write "wheels"]'),
        ({"axle": {"wheels": [{"place": "left"}, {"place": "left", "turn": 1}]}}, '[field: axle.wheels[1].turn] [do: write "turns"]'),
        ({"axle": {}, "spare": {"place": "left", "x": 1}}, "[field: spare.x] [do: leave it out; there are place, turns]"),
        ({"axle": {}, "cuont": 2}, '[field: cuont] [do: write "count"]'),
        ({"axle": {"load_kg": -1}}, "[field: axle.load_kg] [do: give load, kg, for example 500.0]"),
        ({"axle": {}, "count": 1.5}, "[field: count]"),
        ({"axle": {"wheels": [{"place": "front"}]}}, '[field: axle.wheels[0].place] [do: give one of "left", "right"]'),
        ({}, "[field: axle]"),
        ([], "[field: -]"),
    ],
)  # fmt: skip
def test_a_refusal_names_the_field_and_the_remedy(arguments: Any, said: str) -> None:
    with pytest.raises(ArgumentsRefused) as refused:
        decoded(arguments)
    assert said in str(refused.value)
    assert str(refused.value).startswith("arguments of weigh: ")


def test_bytes_that_are_no_json_are_refused_in_the_same_shape() -> None:
    for payload in (b"{", b'{"axle": {}, "count": NaN}', b'{"axle": {"load_kg": 1e999}}', b"\xff"):
        with pytest.raises(ArgumentsRefused, match=r"\[field: .+\] \[do: .+\]"):
            DECODER.decode(payload)


@given(st.integers(-(2**31), 2**31))
def test_a_whole_float_is_the_integer_at_every_depth(number: int) -> None:
    wheel = {"place": "left", "turns": float(number)}
    found = decoded({"axle": {"wheels": [wheel]}, "count": float(number), "spare": wheel, "label": float(number)})
    for each in (found.count, found.axle.wheels[0].turns, found.spare.turns, found.label):
        assert each == number
        assert isinstance(each, int)


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-5, 5)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=4),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["axle", "wheels", "place", "turns", "count", "load_kg", "odd"]), inner, max_size=4
        )
    ),
    max_leaves=8,
)


@given(JSON)
def test_what_is_taken_has_no_field_that_the_tool_does_not_have(arguments: Any) -> None:
    try:
        found = decoded(arguments)
    except ArgumentsRefused:
        return
    assert "odd" not in json.dumps(arguments)
    assert isinstance(found, msgspec.Struct)


@given(
    JSON, st.lists(st.sampled_from(["a", 0]), max_size=4), st.sampled_from([float("nan"), float("inf"), -float("inf")])
)
def test_a_number_that_is_none_is_found_wherever_it_stands(
    other: Any, steps: Sequence[str | int], number: float
) -> None:
    value: Any = number
    for step in steps:
        value = {"other": other, step: value} if isinstance(step, str) else [value, other]
    assert impossible(value)
    assert impossible(other) == ""
