"""A value that no closed list has is refused with the list, wherever in the arguments it stands."""

from enum import Enum
from typing import Annotated, Literal

import msgspec
import pytest

from drivemcp.choices import explained
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from proto.rules import Situation

Letter = Literal["a", "b"]


class Colour(Enum):
    RED = "red"
    BLUE = "blue"


class Cat(msgspec.Struct, tag="cat"):
    lives: int = 9


class Dog(msgspec.Struct, tag="dog"):
    size: Literal["small", "big"] = "small"


class Arguments(msgspec.Struct):
    one: Annotated[Letter | None, msgspec.Meta(description="one")] = None
    many: tuple[Letter, ...] = ()
    pair: tuple[int, Letter] = (0, "a")
    named: dict[str, Letter] = {}
    counted: dict[Letter, int] = {}
    colour: Colour = Colour.RED
    number: Literal[1, 2] = 1
    pet: Cat | Dog = msgspec.field(default_factory=Cat)
    pets: list[Cat | Dog] = []


@pytest.mark.parametrize(
    ("given", "choices"),
    [
        ('{"one":"c"}', '"a", "b", or null where it is not known'),
        ('{"many":["a","c"]}', '"a", "b"'),
        ('{"pair":[1,"c"]}', '"a", "b"'),
        ('{"named":{"x":"c"}}', '"a", "b"'),
        ('{"counted":{"c":1}}', '"a", "b"'),
        ('{"colour":"green"}', '"blue", "red"'),
        ('{"number":3}', "1, 2"),
        ('{"pet":{"type":"cow"}}', '"cat", "dog"'),
        ('{"pets":[{"type":"dog","size":"huge"}]}', '"big", "small"'),
    ],
)
def test_the_error_lists_what_the_field_takes(given: str, choices: str) -> None:
    with pytest.raises(msgspec.ValidationError) as caught:
        msgspec.json.decode(given, type=Arguments)
    assert explained(caught.value, Arguments) == f"{caught.value}: give one of {choices}"


@pytest.mark.parametrize("given", ['{"one":1}', '{"many":3}', "{", '{"pet":{}}', '{"colour":[]}'])
def test_other_errors_keep_their_words(given: str) -> None:
    with pytest.raises(msgspec.MsgspecError) as caught:
        msgspec.json.decode(given, type=Arguments)
    assert explained(caught.value, Arguments) == str(caught.value)


def test_a_bare_value_is_refused_with_the_list_too() -> None:
    with pytest.raises(msgspec.ValidationError) as caught:
        msgspec.json.decode('"c"', type=Letter)
    assert explained(caught.value, Letter).endswith('give one of "a", "b"')


def classes(config: ServiceConfig, node: Node) -> None:
    @node.tool(deadline_ms=1000)
    def class_of(situation: Situation) -> dict[str, str]:
        """The class of a vehicle."""
        return {"class": situation.vehicle_class or ""}


def test_a_caller_of_a_tool_reads_which_classes_of_vehicle_there_are() -> None:
    with bus() as b:
        b.start(Service("rules", ServiceConfig, classes))
        outcome = b.call("class_of", {"situation": {"vehicle_class": "truck"}})
    assert outcome.status == "tool_error"
    for said in ("arguments of class_of: Invalid enum value 'truck'", '"car", ', '"lorry", ', "or null where it is"):
        assert said in outcome.error
