"""Rendered and modelled runs of the same scenes, side by side."""

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from drivemcp.errors import UserError
from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.tables.agree import Compared, compared, page, runs_in
from evaluation.tables.files import write
from tests.unit.evaluation.evaluate.made import kept, table


def found(tmp_path: Path, rendered: dict[str, Any], modelled: dict[str, Any], runs: int = 3) -> list[Compared]:
    sides = []
    for name, numbers in (("rendered", rendered), ("modelled", modelled)):
        write(tmp_path / name, [table("results", partial(_made, numbers), runs)])
        sides.append(runs_in(tmp_path / name, "results"))
    return compared("results", sides[0], sides[1])


def _made(numbers: dict[str, Any], row: Row, number: int) -> Kept:
    return kept(**{name: value[number] if isinstance(value, list) else value for name, value in numbers.items()})


def of(rows: list[Compared], family: str, title: str) -> Compared:
    return next(each for each in rows if each.family == family and each.column.title == title)


def test_the_same_numbers_agree_and_a_steady_difference_does_not(tmp_path: Path) -> None:
    rows = found(
        tmp_path,
        {"event_f1": [0.9, 0.8, 0.7], "overspeed_inferred_pct": [0.1, 0.5, 0.3]},
        {"event_f1": [0.8, 0.69, 0.61], "overspeed_inferred_pct": [0.2, 0.3, 0.4]},
    )
    f1 = of(rows, "all", "event F1")
    assert (f1.rendered, f1.modelled) == pytest.approx((80.0, 70.0))
    assert f1.less.mean == pytest.approx(-10.0)
    assert f1.agree is False
    assert of(rows, "all", "overspeed").agree is True
    assert of(rows, "all", "collisions").agree is True, "all pairs are equal"


def test_one_difference_in_all_pairs_is_none_only_where_it_is_nothing(tmp_path: Path) -> None:
    rows = found(tmp_path, {"event_f1": 0.9}, {"event_f1": 0.8})
    assert of(rows, "all", "event F1").agree is False
    assert of(rows, "all", "overspeed").agree is True


def test_each_family_stands_for_itself_and_all_of_them_together(tmp_path: Path) -> None:
    rows = found(tmp_path, {}, {})
    families = list(dict.fromkeys(each.family for each in rows))
    assert families[-1] == "all"
    assert of(rows, "all", "infractions").less.n == sum(of(rows, name, "infractions").less.n for name in families[:-1])


def test_what_one_side_did_not_measure_is_no_pair(tmp_path: Path) -> None:
    rows = found(tmp_path, {"hazard_response_s": [(0.2,), (), (0.4,)]}, {"hazard_response_s": [(), (0.3,), (0.5,)]})
    response = of(rows, "all", "hazard response")
    assert response.less.mean == pytest.approx(0.1)
    assert response.less.n * 3 == of(rows, "all", "infractions").less.n


def test_the_page_says_what_agrees(tmp_path: Path) -> None:
    told = page(found(tmp_path, {"event_f1": [0.9, 0.8, 0.7]}, {"event_f1": [0.8, 0.69, 0.61]}))
    assert "| all | event F1, % | " in told
    assert "| 80.0 | 70.0 | -10.0 [" in told
    assert "| **no** |" in told
    assert "agree. 4 have an interval, and 0 intervals contain 0; by chance 0 would not." in told, (
        "event F1, of each family"
    )


def test_a_folder_without_a_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"results\.json"):
        runs_in(tmp_path, "results")
    (tmp_path / "results.json").write_text("{}")
    with pytest.raises(UserError, match=r"results\.json"):
        runs_in(tmp_path, "results")


def test_a_difference_that_is_too_small_to_show_is_one(tmp_path: Path) -> None:
    rows = found(tmp_path, {"event_f1": [0.9, 0.8, 0.7]}, {"event_f1": [0.9001, 0.80011, 0.70012]})
    assert of(rows, "all", "event F1").agree is False


def test_runs_with_other_latencies_or_settings_are_no_pair(tmp_path: Path) -> None:
    asked: list[dict[str, Any]] = [
        {},
        {"settings": {"logger": {"pictures": "none"}}},
        {"modelled_ms": {"retrieve": 22.4}},
        {"settings": {"drivelm": {"prompt_backend": "openai"}}},
    ]
    sides = []
    for at, more in enumerate(asked):
        write(tmp_path / f"{at}", [table("results", partial(_made, {}), **more)])
        sides.append(runs_in(tmp_path / f"{at}", "results"))
    assert compared("results", sides[0], sides[1]), "what is logged changes no run"
    assert not compared("results", sides[0], sides[2])
    assert not compared("results", sides[0], sides[3])


def test_the_first_seconds_of_a_route_are_no_pair_of_the_whole(tmp_path: Path) -> None:
    for name, seconds in (("short", 5.0), ("whole", 0.0)):
        write(tmp_path / name, [table("results", partial(_made, {}), seconds=seconds)])
    short, whole = (runs_in(tmp_path / name, "results") for name in ("short", "whole"))
    assert compared("results", short, short)
    assert not compared("results", short, whole)
