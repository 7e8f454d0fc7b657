"""What the law is taken to be while the Rules are silent."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from services.orchestrator.target.target import CAUTIOUS_MPS, law_of
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    KMH,
    TICK,
    Drive,
    Played,
    conditions,
    end_sign,
    fact,
    limit_answer,
    limit_sign,
    replace,
)


def driven(limit_kmh: float = 100.0, road: str = "rural") -> Drive:
    """A drive whose limit the Rules have told, and who then fall silent."""
    drive = Drive(Played({**EXPERTS, "applicable_limit": lambda a: limit_answer(limit_kmh)}), road=road)
    drive.ticks(3)
    drive.ask.table = {}
    return drive


@pytest.mark.parametrize("seconds", [0.1, 1.0, 5.0])
def test_the_limit_of_the_country_road_does_not_hold_in_town(seconds: float) -> None:
    drive = driven()
    drive.tick(end_sign("town_entry"))
    drive.ticks(int(seconds * 10))
    law = law_of(drive.state)
    assert law.mps == pytest.approx(CAUTIOUS_MPS["urban"])
    assert law.basis == "unknown"
    assert law.confidence < 0.5


@pytest.mark.parametrize("news", [fact("jurisdiction", "FRA"), end_sign("border:FRA"), fact("road_type", "urban")])
def test_another_country_or_road_makes_the_last_answer_an_upper_bound_beside_caution(news: Fact) -> None:
    drive = driven()
    drive.tick(news)
    assert law_of(drive.state).mps == pytest.approx(CAUTIOUS_MPS["urban" if news.kind == "road_type" else "rural"])


def test_a_lower_limit_of_the_last_road_still_holds() -> None:
    drive = driven(20.0, "living_street")
    drive.tick(end_sign("town_exit"))
    assert law_of(drive.state).mps == pytest.approx(20 * KMH)


def test_on_the_same_road_the_last_answer_holds_when_the_weather_changes() -> None:
    drive = driven()
    drive.weather = conditions(visibility_m=120.0, wet=True)
    drive.ticks(40)
    law = law_of(drive.state)
    assert law.basis == "held"
    assert law.mps == pytest.approx(100 * KMH)


def test_the_maps_road_alone_refutes_a_limit_that_no_such_road_has() -> None:
    drive = driven()
    drive.state = replace(drive.state, signs=replace(drive.state.signs, road_type=None))
    drive.road = "urban"
    drive.tick()
    assert law_of(drive.state).mps == pytest.approx(CAUTIOUS_MPS["urban"])


PLACES = (
    end_sign("town_entry"), end_sign("town_exit"), end_sign("motorway"), end_sign("calm_street"),
    end_sign("border:FRA"), fact("jurisdiction", "AUT"), fact("road_type", "urban"), fact("road_type", "motorway"),
)  # fmt: skip


@FEW
@given(st.sampled_from((30.0, 50.0, 70.0, 100.0, 130.0)), st.sampled_from(("urban", "rural", "motorway")),
       st.sampled_from(PLACES), st.integers(0, 30))  # fmt: skip
def test_a_change_of_place_without_the_rules_never_raises_the_target(
    limit_kmh: float, road: str, news: Fact, ticks: int
) -> None:
    drive = driven(limit_kmh, road)
    stood = drive.target_mps
    drive.tick(news)
    drive.ticks(ticks + 1)
    assert drive.target_mps <= stood + 1e-9


def test_a_new_answer_for_the_new_place_counts_at_once() -> None:
    drive = driven()
    drive.ask.table = EXPERTS
    drive.tick(end_sign("town_entry"))
    law = law_of(drive.state)
    assert law.basis == "rules"
    assert law.mps == pytest.approx(50 * KMH)
    drive.ask.table = {}
    drive.now_ns += TICK
    drive.tick(limit_sign("limit:30"))
    assert law_of(drive.state).mps == pytest.approx(30 * KMH)


@FEW
@given(st.floats(0.0, 0.39), st.sampled_from((50.0, 100.0, None)), st.sampled_from(("urban", "rural", "motorway")))
def test_a_doubted_answer_raises_no_limit_above_a_believed_sign(sure: float, kmh: float | None, road: str) -> None:
    answer = limit_answer(kmh or 50.0, confidence=sure)
    answer = answer if kmh is not None else replace(answer, limit=None)
    drive = Drive(Played({**EXPERTS, "applicable_limit": lambda a: answer}), speed_mps=8.0, road=road)
    for _ in range(40):
        drive.tick(limit_sign("limit:30"))
        assert drive.target_mps <= 30 * KMH + 1e-9
        assert law_of(drive.state).mps == pytest.approx(30 * KMH)


@FEW
@given(st.floats(0.0, 0.39))
def test_a_doubted_answer_below_a_sign_lowers(sure: float) -> None:
    drive = Drive(Played({**EXPERTS, "applicable_limit": lambda a: limit_answer(30.0, confidence=sure)}))
    drive.tick(limit_sign("limit:50"))
    drive.ticks(40)
    assert law_of(drive.state).mps == pytest.approx(30 * KMH)
