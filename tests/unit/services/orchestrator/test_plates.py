"""Plates with numbers restrict their signs as those without do: a number read raises and ends nothing."""

import pytest
from hypothesis import given

from drivemcp.paths import data
from proto.rules import PostedLimit, Situation
from services.orchestrator.law.rules_question import situation
from services.orchestrator.signs.limits import in_force
from services.orchestrator.signs.signs import known_plate
from services.rules.book import load_book
from services.rules.limits.limit_answer import applicable_limit
from tests.unit.robustness.hostile import hostile
from tests.unit.services.orchestrator.support import FEW, KMH, Drive, limit_sign


@pytest.mark.parametrize(
    "plate", ["plate:time:22-6 h", "plate:distance:200 m", "plate:length:1.5 km", "plate:distance:1/2 miles"]
)
def test_a_number_of_a_known_form_is_kept(plate: str) -> None:
    assert known_plate(plate) == plate


@pytest.mark.parametrize("tail", ["25-6 h", "22-6 h 130", "6 h", "", "ignore", "٢٢-6 h", "22-6 h\n"])
def test_any_other_is_dropped_and_the_plate_is_not(tail: str) -> None:
    assert known_plate(f"plate:time:{tail}") == "plate:time"


@FEW
@given(hostile())
def test_hostile_numbers_never_make_a_restricted_limit_an_unrestricted_one(text: str) -> None:
    drive, other = Drive(), Drive()
    for each, plate in ((drive, f"plate:time:{text}"), (other, "plate:time")):
        each.tick(limit_sign("limit:30"))
        each.tick(limit_sign("limit:100", track_id=8, plates=(plate,)))
    assert drive.target_mps == other.target_mps == pytest.approx(30 * KMH)
    assert drive.state.signs.conditional[0].posted.plates == other.state.signs.conditional[0].posted.plates


@pytest.mark.parametrize("plate", ["plate:time", "plate:time:22-6 h", "plate:distance", "plate:distance:400 m"])
def test_a_limit_under_such_a_plate_lowers_and_replaces_no_lower_one(plate: str) -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:50"))
    drive.tick(limit_sign("limit:100", track_id=8, plates=(plate,)))
    assert drive.target_mps == pytest.approx(50 * KMH)
    drive.tick(limit_sign("limit:30", track_id=9, plates=(plate,)))
    assert drive.target_mps == pytest.approx(30 * KMH)
    assert in_force(drive.state.signs)


def test_the_rules_are_not_told_the_hours_of_a_plate_so_that_they_always_may_hold() -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:30", plates=("plate:time:22-6 h",)))
    asked = situation(drive.state)
    assert asked.time_of_day_h is None
    assert asked.posted[0].plates == ("plate:time",)


@pytest.mark.parametrize("plate", ["plate:time", "plate:time:22-6 h", "plate:time:0-1 h", "plate:time:99-6 h"])
def test_the_rules_apply_a_limit_whose_hours_may_hold(plate: str) -> None:
    book = load_book((data("rulepacks/DEU-v1"),))[0]
    posted = PostedLimit(value=30.0, unit="km/h", plates=(plate,), reading="limit:30")
    answer = applicable_limit(book, Situation(jurisdiction="DEU", road_type="urban", posted=(posted,)))
    assert answer.limit is not None
    assert answer.limit.value == 30.0
