"""The cells that are compared: type of road, class of vehicle and weather, as the table's tags and as a question to the rules."""

from collections.abc import Iterator
from typing import Any

import msgspec

from proto.rules import Situation
from services.rules.book import RuleBook, is_fallback
from studies.default_limits.filters import Tags
from studies.default_limits.speeds import Moment, Vehicle
from studies.default_limits.table import Table

ALPHA2 = {
    "AUT": "AT", "BEL": "BE", "CHE": "CH", "DEU": "DE", "ESP": "ES", "FRA": "FR", "GBR": "GB", "IRL": "IE", "ITA": "IT",
    "NLD": "NL", "POL": "PL", "USA": "US",
}  # fmt: skip
TOWN, COUNTRY = {"zone:traffic": "XX:urban", "sidewalk": "both"}, {"zone:traffic": "XX:rural"}
ONE_LANE, TWO_LANES = {"oneway": "no", "lanes": "2"}, {"oneway": "yes", "dual_carriageway": "yes", "lanes": "2"}
FAST = {"highway": "trunk", "motorroad": "yes", "shoulder": "yes"}


class Road(msgspec.Struct, frozen=True):
    """A type of road on both sides."""

    tags: Tags
    asked: dict[str, Any]
    """Fields of `Situation`."""


ROADS = {
    "living_street": Road({"highway": "living_street"}, {"road_type": "living_street"}),
    "urban": Road({"highway": "secondary", "lit": "yes", **TOWN, **ONE_LANE}, {"road_type": "urban", "lit": True}),
    "rural": Road({"highway": "secondary", **COUNTRY, **ONE_LANE}, {"road_type": "rural", "divided": False}),
    "dual_carriageway": Road(
        {"highway": "secondary", **COUNTRY, **TWO_LANES}, {"road_type": "dual_carriageway", "divided": True}
    ),
    "expressway": Road({**FAST, **COUNTRY, **ONE_LANE}, {"road_type": "expressway", "divided": False}),
    "divided_expressway": Road({**FAST, **COUNTRY, **TWO_LANES}, {"road_type": "expressway", "divided": True}),
    "motorway": Road({"highway": "motorway", **COUNTRY, **TWO_LANES}, {"road_type": "motorway", "divided": True}),
}
_HEAVY = {"maxweightrating": 18.0, "emptyweight": 10.0, "length": 12.0, "seats": 50.0}
_TRAIN = {"maxweightrating": 18.0, "emptyweight": 10.0, "trailerweight": 18.0, "trailers": 1.0}
VEHICLES: dict[str, tuple[Vehicle, dict[str, Any]]] = {
    "car": (Vehicle(amounts={"maxweightrating": 2.0, "emptyweight": 1.5}), {"mass_t": 2.0}),
    "motorcycle": (Vehicle(modes=("motorcycle",), amounts={"maxweightrating": 0.4}), {"mass_t": 0.4}),
    "van": (Vehicle(modes=("goods",), amounts={"maxweightrating": 3.0, "emptyweight": 2.0}), {"mass_t": 3.0}),
    "car_trailer": (
        Vehicle(facts=frozenset({"trailer"}), amounts={"maxweightrating": 2.0, "trailerweight": 1.2, "trailers": 1.0}),
        {"mass_t": 2.0, "trailer_t": 1.2, "combination_t": 3.2},
    ),
    "van_trailer": (
        Vehicle(
            modes=("goods",),
            facts=frozenset({"trailer"}),
            amounts={"maxweightrating": 2.3, "trailerweight": 1.2, "trailers": 1.0},
        ),
        {"mass_t": 2.3, "trailer_t": 1.2, "combination_t": 3.5},
    ),
    "lorry_light": (Vehicle(modes=("hgv", "goods"), amounts={**_HEAVY, "maxweightrating": 7.5}), {"mass_t": 7.5}),
    "lorry": (Vehicle(modes=("hgv", "goods"), amounts=_HEAVY), {"mass_t": 18.0}),
    "lorry_trailer": (
        Vehicle(modes=("hgv", "goods"), facts=frozenset({"trailer", "articulated"}), amounts=_TRAIN),
        {"mass_t": 18.0, "trailer_t": 18.0, "combination_t": 36.0},
    ),
    "bus": (Vehicle(modes=("bus",), amounts=_HEAVY), {"mass_t": 18.0}),
    "coach": (Vehicle(modes=("coach", "bus"), amounts=_HEAVY), {"mass_t": 18.0, "plate_100": True}),
}
WEATHERS = {"dry": Moment(), "wet": Moment(wet=True)}


class Cell(msgspec.Struct, frozen=True, order=True):
    """One limit of the table; `minimum` in place of a class is the speed that slow vehicles must be able to reach."""

    pack: str
    place: str
    road: str
    vehicle: str
    weather: str

    def __str__(self) -> str:
        return " ".join((self.pack, self.place, self.road, self.vehicle, self.weather))


MINIMUM = "minimum"


def cells(book: RuleBook, table: Table) -> Iterator[Cell]:
    """Every cell for which the table has a row and one of the packs a country."""
    for pack, place in _places(book, table):
        for road in ROADS:
            if _told_of(table, place, road):
                yield from (Cell(pack, place, road, vehicle, weather) for vehicle in VEHICLES for weather in WEATHERS)
                yield Cell(pack, place, road, MINIMUM, "dry")


def _told_of(table: Table, place: str, road: str) -> bool:
    """Whether the table says something of such a road: a calmed street is not the country's usual road."""
    row = table.row(code(place), ROADS[road].tags)
    return row is not None and (row.name is not None or road != "living_street")


def question(cell: Cell) -> Situation:
    """As the rules are asked: every fact that the table knows is told, and good sight by day."""
    moment = WEATHERS[cell.weather]
    facts = VEHICLES[cell.vehicle][1] if cell.vehicle in VEHICLES else VEHICLES["car"][1]
    return msgspec.convert(
        {
            "jurisdiction": cell.place,
            "vehicle_class": cell.vehicle if cell.vehicle in VEHICLES else "car",
            "wet": moment.wet,
            "time_of_day_h": moment.hour,
            "snow": False,
            "visibility_m": 1000.0,
            **ROADS[cell.road].asked,
            **facts,
        },
        Situation,
    )


def code(place: str) -> str:
    """`GBR-SCT` as the table writes it, `GB-SCT`."""
    country, hyphen, part = place.partition("-")
    return ALPHA2.get(country, country) + hyphen + part


def _places(book: RuleBook, table: Table) -> Iterator[tuple[str, str]]:
    """Pack and place: each pack's own, and the parts of which its law or the table says something."""
    packs = [pack for pack in book.packs.values() if not is_fallback(pack)]
    extended = {name for pack in packs for name in pack.family[1:]}
    for pack in packs:
        law = pack.manifest.jurisdiction
        stated = {effect.when.subdivision for _, effect in pack.limits if effect.when.subdivision is not None}
        start = f"{code(law)}-"
        told = {law + row[len(code(law)) :] for row in table.speed_limits_by_country_code if row.startswith(start)}
        if pack.manifest.id not in extended:
            yield from ((pack.manifest.id, place) for place in (law, *sorted(stated | told)) if table.rows(code(place)))
