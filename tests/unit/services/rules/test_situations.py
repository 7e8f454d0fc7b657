"""Coarse situations, so that repeats are cached, never raise a limit."""

import pytest

from proto.rules import PostedLimit, Situation
from proto.scene import Candidate
from services.rules.signs.sign_codes import hours_of, within_hours
from services.rules.situations import coarse


def test_what_differs_only_by_age_and_hair_is_one_situation() -> None:
    def seen(age_s: float, sure: float, visibility_m: float) -> Situation:
        return coarse(
            Situation(
                segment_id="a",
                posted=(PostedLimit(value=80, unit="km/h", age_s=age_s, confidence=sure),),
                visibility_m=visibility_m,
                candidates=(Candidate(reading="limit:80", confidence=sure),),
            )
        )

    assert seen(1.0, 0.951, 120.2) == seen(7.5, 0.959, 120.9)
    assert hash(seen(1.0, 0.951, 120.2)) == hash(seen(7.5, 0.959, 120.9))
    assert seen(1.0, 0.95, 49.9) != seen(1.0, 0.95, 50.0)


def test_beside_an_end_it_is_kept_what_was_seen_later() -> None:
    def seen(*ages_s: float) -> tuple[float, ...]:
        scopes = ("permanent", "end", "gantry")
        posted = (PostedLimit(value=80, unit="km/h", scope=scopes[at], age_s=age) for at, age in enumerate(ages_s))  # type: ignore[arg-type]
        return tuple(limit.age_s for limit in coarse(Situation(posted=tuple(posted))).posted)

    assert seen(3.1, 9.7, 9.7) == seen(4.0, 5.0, 5.0) == (0.0, 1.0, 1.0)
    assert seen(7.0, float("nan"), float("nan")) == (1.0, 2.0, 0.0)


def test_rounding_goes_to_the_careful_side() -> None:
    made = coarse(Situation(visibility_m=50.99, posted=(PostedLimit(value=70, unit="km/h", confidence=0.4999),)))
    assert made.visibility_m == 50.0
    assert made.posted[0].confidence == pytest.approx(0.49)


def test_a_span_of_hours_begins_and_ends_at_its_minute() -> None:
    for minute in range(24 * 60 - 1):
        clock, later = (f"{at // 60}:{at % 60:02}" for at in (minute, minute + 1))
        (span,) = hours_of(f"plate:time:{clock}-{later}")
        for hour in (minute / 60, minute // 60 + minute % 60 / 60):
            now = coarse(Situation(time_of_day_h=hour)).time_of_day_h
            assert now is not None
            assert within_hours(span, now)
            assert not within_hours((span[1], 24.0), now)


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_is_no_number_becomes_unknown(number: float) -> None:
    assert coarse(Situation(visibility_m=number)).visibility_m is None
