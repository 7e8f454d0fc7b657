"""A scenario of a family: the layout of its place in the split, and what its number varies on it."""

from collections.abc import Callable, Mapping
from random import Random

import msgspec

from evaluation.scenarios import border, motorway, town
from evaluation.scenarios.names import LAYOUTS, Family, Place, Split
from evaluation.scenarios.variation import vary
from services.simulator.scenario.plan import Scenario

Lay = Callable[[Random, str, int], Scenario]
LAY: Mapping[Family, Lay] = {"urb-rain": town.lay, "cross-border": border.lay, "dynamic-vsl": motorway.lay}


def generate(family: Family, number: int, split: Split) -> Scenario:
    """The scenario `family/split/number`; numbers and layouts go on without end, kinds of layouts come again after `LAYOUTS`."""
    place = Place(family, split, number)
    layout = lay(family, place.layout)
    return vary(msgspec.structs.replace(layout, name=f"{family}-{split}-{number}"), family, Random(str(place)))


def lay(family: Family, layout: int) -> Scenario:
    """A layout of a family, from 0 on, without weather, traffic and driver."""
    return LAY[family](Random(f"{family} layout {layout}"), f"{family}-layout-{layout}", layout % LAYOUTS)
