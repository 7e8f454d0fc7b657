"""Kinds of road that signs announce, and facts of the weather that nobody knows, in the question to the Rules."""

import pytest

from services.orchestrator.law.rules_question import situation
from services.orchestrator.signs.limits import ROAD_TYPES
from services.orchestrator.target.target import CAUTIOUS_MPS, PLAUSIBLE_KMH
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    Drive,
    Played,
    conditions,
    end_sign,
    fact,
    limit_answer,
    limit_sign,
    preferences,
)


def test_an_expressways_sign_is_told_to_the_rules() -> None:
    drive = Drive(road="rural")
    drive.tick(end_sign("expressway"))
    assert situation(drive.state).road_type == "expressway"
    drive.tick(end_sign("expressway_end", track_id=10))
    assert situation(drive.state).road_type == "rural"


def test_an_expressways_sign_lifts_no_limit() -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:70"))
    drive.tick(end_sign("expressway"))
    assert [limit.value for limit in situation(drive.state).posted] == [70]


def test_a_statement_of_an_expressway_is_believed() -> None:
    drive = Drive(road="rural")
    drive.tick(fact("road_type", "expressway"))
    assert situation(drive.state).road_type == "expressway"


def test_every_kind_of_road_has_its_caution() -> None:
    assert set(CAUTIOUS_MPS) == set(PLAUSIBLE_KMH) == ROAD_TYPES


@pytest.mark.parametrize(("fallen", "snow"), [("unknown", None), ("snow", True), ("rain", False), ("none", False)])
def test_snow_is_unknown_where_nobody_knows_what_falls(fallen: str, snow: bool | None) -> None:
    drive = Drive()
    drive.weather = conditions(precipitation=fallen)
    drive.ticks(2)
    assert situation(drive.state).snow is snow


@pytest.mark.parametrize("degraded", [("jurisdiction",), ()])
def test_whose_law_it_is_is_told_where_the_rules_do_not_know_the_place(degraded: tuple[str, ...]) -> None:
    note = "It is lower in Wales: 20 mph."
    answer = limit_answer(30, "mph", degraded=degraded, note=note)
    drive = Drive(
        Played({**EXPERTS, "applicable_limit": lambda a: answer}), speed_mps=16.0, preferences=preferences(unit="mph")
    )
    drive.ticks(80)
    told = [t.advisory.justification for _, _, t in drive.history if t.advisory.directive.startswith("Slow down: 30")]
    assert told
    assert all((note in justification) is bool(degraded) for justification in told)
