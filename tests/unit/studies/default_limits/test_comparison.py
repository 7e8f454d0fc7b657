"""Every pack against a table of default limits, each difference with its explanation.

The world's table is fetched by its user; a small one of this project's own tests the rest.
"""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest

from services.rules.book import RuleBook
from studies.default_limits.__main__ import FETCH, USUAL, VARIABLE, main
from studies.default_limits.cells import Cell, cells
from studies.default_limits.comparison import Compared, Explanation, compare, read_explained
from studies.default_limits.filters import FilterError
from studies.default_limits.table import Table, TableError, read_table
from studies.law.situations import every_book

ROOT = Path(__file__).parents[4]
FETCHED = Path(os.environ.get(VARIABLE) or ROOT / USUAL)
TYPES = {
    "town": {"filter": "zone:traffic~.*urban"},
    "country": {"filter": "zone:traffic~.*rural"},
    "two lanes": {"filter": "{country} and lanes>=2 and oneway=yes", "fuzzyFilter": "highway=primary"},
    "fast": {"filter": "highway~motorway|motorway_link"},
    "by guess": {"fuzzyFilter": "highway=secondary"},
}
AUSTRIA: list[dict[str, Any]] = [
    {"name": "town", "tags": {"maxspeed": "50"}},
    {"tags": {"maxspeed": "100", "maxspeed:hgv": "70"}},
    {"name": "country", "tags": {"maxspeed": "100", "maxspeed:hgv": "70"}},
    {"name": "fast", "tags": {"maxspeed": "130", "maxspeed:hgv": "80", "maxspeed:conditional": "100 @ (trailer)"}},
]


@pytest.fixture(scope="module")
def book() -> RuleBook:
    return every_book()


def table(rows: Mapping[str, Sequence[dict[str, Any]]], types: Mapping[str, Any] = TYPES) -> Table:
    return msgspec.convert({"roadTypesByName": types, "speedLimitsByCountryCode": rows}, Table)


def car(found: Compared, road: str) -> str:
    return next(each.result for each in found.found if each.cell == Cell("AUT-v1", "AUT", road, "car", "dry"))


def changed(road: str, limit: str) -> Table:
    rows = [{**row, "tags": {**row["tags"], "maxspeed": limit}} if row.get("name") == road else row for row in AUSTRIA]
    return table({"AT": rows})


def explanation(ours: str = "130 km/h", their: str = "120 km/h", **changes: Any) -> Explanation:
    usual: dict[str, Any] = {
        "pack": "AUT-v1", "places": ["AUT"], "roads": ["motorway"], "vehicles": ["car", "motorcycle", "van"],
        "table": their, "ours": ours, "right": "pack", "law": "StVO § 20 Abs. 2", "why": "The table is older.",
    }  # fmt: skip
    return msgspec.convert(usual | changes, Explanation)


def test_the_row_furthest_below_the_rest_s_holds_then_the_first_above_it() -> None:
    found = table({"AT": AUSTRIA})
    by_road = {
        "town": {"zone:traffic": "AT:urban"},
        "country": {"zone:traffic": "AT:rural"},
        "fast": {"zone:traffic": "AT:rural", "highway": "motorway"},
        None: {"highway": "track"},
    }
    for name, tags in by_road.items():
        row = found.row("AT", tags)
        assert row is not None
        assert row.name == name


def test_a_part_of_a_country_has_its_own_rows_else_the_country_s() -> None:
    found = table({"AT": AUSTRIA, "AT-9": [{"tags": {"maxspeed": "30"}}]})
    assert found.row("AT-9", {}) == found.rows("AT-9")[0]
    assert found.rows("AT-1") == found.rows("AT")
    assert found.row("HU", {}) is None


def test_a_type_that_only_a_guess_tells_is_not_asked() -> None:
    row = table({"AT": [{"name": "by guess", "tags": {}}, {"tags": {"maxspeed": "70"}}]}).row(
        "AT", {"highway": "secondary"}
    )
    assert row is not None
    assert row.name is None


def test_filters_that_name_each_other_are_refused() -> None:
    ring = {"a": {"filter": "{b}"}, "b": {"filter": "{a}"}}
    with pytest.raises(FilterError, match="leads back"):
        table({"AT": [{"name": "a", "tags": {}}]}, ring).row("AT", {})


def test_cells_are_asked_for_countries_that_both_know(book: RuleBook) -> None:
    found = {(cell.pack, cell.place) for cell in cells(book, table({"AT": AUSTRIA, "HU": AUSTRIA, "GB-SCT": AUSTRIA}))}
    assert found == {("AUT-v1", "AUT"), ("GBR-v1", "GBR-SCT")}


def test_limits_are_asked_by_road_class_and_weather_and_agree(book: RuleBook) -> None:
    found = compare(book, table({"AT": AUSTRIA}), [])
    assert [car(found, road) for road in ("urban", "rural", "motorway")] == ["agree"] * 3
    assert {each.cell.weather for each in found.found} == {"dry", "wet"}
    assert "lorry_trailer" in {each.cell.vehicle for each in found.found}


def test_a_pack_may_be_below_or_above(book: RuleBook) -> None:
    assert car(compare(book, changed("fast", "140"), []), "motorway") == "below"
    assert car(compare(book, changed("fast", "120"), []), "motorway") == "above"


def test_a_difference_without_explanation_is_told(book: RuleBook) -> None:
    before, found = compare(book, table({"AT": AUSTRIA}), []), compare(book, changed("fast", "120"), [])
    new = set(found.unexplained) - set(before.unexplained)
    assert "AUT-v1 AUT motorway car dry: above: table 120 km/h, pack 130 km/h" in new
    assert {text.split()[3] for text in new} == {"car", "motorcycle", "van", "bus", "coach"}


def test_an_explained_difference_is_not_told(book: RuleBook) -> None:
    found = compare(book, changed("fast", "120"), [explanation()])
    assert not [text for text in found.unexplained if "motorway car" in text]
    assert found.outdated == ()


@pytest.mark.parametrize(
    "stale",
    [
        explanation(ours="140 km/h"),
        explanation(their="110 km/h"),
        explanation(roads=["rural"]),
        explanation(vehicles=["lorry"]),
        explanation(right="table"),
    ],
)
def test_an_explanation_that_does_not_fit_is_told(book: RuleBook, stale: Explanation) -> None:
    """That the table is right excuses no pack that allows more."""
    assert compare(book, changed("fast", "120"), [stale]).outdated


def test_a_cell_that_is_explained_twice_is_told(book: RuleBook) -> None:
    assert compare(book, changed("fast", "120"), [explanation(), explanation()]).outdated


def test_explanations_of_packs_that_the_table_does_not_reach_are_left_alone(book: RuleBook) -> None:
    assert compare(book, changed("fast", "120"), [explanation(), *_of_others()]).outdated == ()


def _of_others() -> list[Explanation]:
    return [each for each in read_explained() if each.pack != "AUT-v1"]


def test_every_explanation_names_a_pack_its_law_and_why(book: RuleBook) -> None:
    known = {pack.manifest.id for pack in book.packs.values()}
    for each in read_explained():
        assert each.pack in known
        assert each.law
        assert each.why.endswith(".")
        assert list(each.cells())


def test_the_command_tells_what_is_not_explained(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "table.json"
    path.write_text(json.dumps({"roadTypesByName": TYPES, "speedLimitsByCountryCode": {"AT": AUSTRIA}}))
    assert main([str(path)]) == 1
    told = capsys.readouterr().out
    assert "| AUT-v1 |" in told
    assert "not explained: AUT-v1 AUT" in told


def test_a_table_that_is_not_there_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "none.json")]) == 2
    assert "osm-legal-default-speeds" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"", b"[]", b'{"roadTypesByName": {}}', b"\xff"])
def test_a_file_that_is_no_table_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "table.json").write_bytes(content)
    with pytest.raises(TableError, match="is not the table"):
        read_table(tmp_path / "table.json")


@pytest.mark.skipif(not FETCHED.is_file(), reason=FETCH)
def test_every_difference_from_the_world_s_table_is_explained(book: RuleBook) -> None:
    found = compare(book, read_table(FETCHED), read_explained())
    assert found.unexplained == ()
    assert found.outdated == ()
