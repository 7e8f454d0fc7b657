"""What infractions came from, by hand: 20 m/s are driven, a limit of 10 m/s begins at 12 s and is kept from 15 s on."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.metrics import At, Record, measure
from evaluation.metrics.law import speeding_episodes
from evaluation.metrics.told import causes, speedings
from proto.decision import Advisory
from proto.speed_assistance import Picture
from tests.unit.evaluation.metrics.logs import said, truths


def drive(*words: At[Advisory]) -> Record:
    def at(time_s: float) -> dict[str, Any]:
        return {"speed_mps": 20.0 if time_s < 15.0 else 10.0, "law_limit_mps": 20.0 if time_s < 12.0 else 10.0}

    return Record(truths=truths(20.0, at), advisories=words)


def ahead(time_s: float, mps: float = 10.0) -> At[Advisory]:
    return said(time_s, topic="ahead", ahead_mps=mps, asked_mps=mps)


def test_a_driver_who_could_have_braked_softly_was_told_in_time() -> None:
    # 10 m/s to lose in 12.0 - 4.0 - 1.25 = 6.75 s: 1.48 m/s²
    (found,) = speedings(drive(ahead(4.0)))
    assert (found.from_s, found.to_s, found.limit_mps, found.by_mps) == pytest.approx((12.0, 14.95, 10.0, 10.0))
    assert found.told_s == 4.0
    assert found.needs_mps2 == pytest.approx(10.0 / 6.75)
    assert found.cause == "told in time"


def test_who_would_have_had_to_brake_hard_was_told_late() -> None:
    # 10 m/s in 12.0 - 8.0 - 1.25 = 2.75 s: 3.64 m/s²; at 11 s no time is left at all
    (found,) = speedings(drive(ahead(8.0)))
    assert found.needs_mps2 == pytest.approx(10.0 / 2.75)
    assert found.cause == "told late"
    (found,) = speedings(drive(ahead(11.0)))
    assert found.needs_mps2 == float("inf")
    assert found.cause == "told late"


def test_only_words_on_that_limit_count_and_only_before_it_is_exceeded() -> None:
    other = (ahead(4.0, 15.0), said(5.0, topic="limit", asked_mps=9.0), said(6.0, topic="person", asked_mps=0.0))
    for words in ((), other, (ahead(4.0)._replace(time_s=12.5),)):
        (found,) = speedings(drive(*words))
        assert found.told_s is None
        assert found.cause == "not told"


def test_a_limit_asked_for_where_it_is_in_force_and_a_sign_that_is_explained_are_words_on_it() -> None:
    at = lambda time_s: {"speed_mps": 9.0 if time_s < 10.0 else 12.0 if time_s < 14.0 else 9.0}  # noqa: E731
    here = Record(truths=truths(20.0, at, law_limit_mps=10.0), advisories=(said(6.0, asked_mps=9.0),))
    (found,) = speedings(here)
    assert found.told_s == 6.0
    assert found.needs_mps2 == 0.0
    assert found.cause == "told in time"
    for value, told_s in ((36.0, 4.0), (136.0, None)):
        sign = Picture(face="sign", value=value, unit="km/h")
        (found,) = speedings(drive(said(4.0, topic="foreign", picture=sign)))
        assert found.told_s == told_s


def test_a_limit_that_was_told_when_it_began_is_still_told_a_minute_later() -> None:
    late = truths(60.0, lambda time_s: {"speed_mps": 9.0 if time_s < 50.0 else 12.0}, law_limit_mps=10.0)
    (found,) = speedings(Record(truths=late, advisories=(said(3.0, told_limit_mps=10.0),)))
    assert (found.told_s, found.cause) == (3.0, "told in time")


def test_what_was_said_half_a_minute_before_the_limit_began_does_not_count() -> None:
    def at(time_s: float) -> dict[str, Any]:
        return {"speed_mps": 20.0, "law_limit_mps": 20.0 if time_s < 40.0 else 10.0}

    for said_s, told_s in ((14.0, None), (16.0, 16.0)):
        (found,) = speedings(Record(truths=truths(60.0, at), advisories=(ahead(said_s),)))
        assert found.told_s == told_s


def test_a_higher_limit_told_after_the_right_one_was_told_wrongly() -> None:
    def at(time_s: float) -> dict[str, Any]:
        return {
            "speed_mps": 20.0 if time_s < 12.0 else 10.0 if time_s < 20.0 else 14.0,
            "law_limit_mps": 20.0 if time_s < 12.0 else 10.0,
        }

    words = (ahead(4.0), said(12.5, told_limit_mps=10.0), said(15.0, told_limit_mps=14.0))
    (found,) = speedings(Record(truths=truths(30.0, at), advisories=words))
    assert found.cause == "told wrongly"
    (found,) = speedings(Record(truths=truths(30.0, at), advisories=words[:2]))
    assert found.cause == "told in time"


RED = {"topic": "stop", "hazard": "red_light"}


@pytest.mark.parametrize(
    ("infraction", "words", "cause"),
    [
        # 10 m/s: the median driver needs 12.5 m and 6.4 m with 0.8 g; at 8.0 s 20 m are left, at 8.3 s 17 m
        ("red_light", (said(8.0, **RED),), "told in time"),
        ("red_light", (said(8.3, **RED),), "told late"),
        ("red_light", (said(8.0, topic="lead", hazard="closing_lead"),), "not told"),
        ("red_light", (said(8.0, **RED), said(9.0, topic="stop", picture=Picture(face="green_light"))), "told wrongly"),
        ("no_stop", (said(5.0, topic="stop"),), "told in time"),
        ("no_stop", (), "not told"),
        ("wrong_yield", (said(5.0, topic="give_way"),), "told in time"),
        ("wrong_yield", (said(5.0, **RED),), "not told"),
    ],
)
def test_a_line_run_was_told_in_time_where_the_median_driver_could_have_stopped(
    infraction: str, words: tuple[At[Advisory], ...], cause: str
) -> None:
    def at(time_s: float) -> dict[str, Any]:
        return {"speed_mps": 10.0, "infraction": infraction if time_s == 10.0 else ""}

    record = Record(truths=truths(12.0, at), advisories=words)
    assert {name for name, count in causes(record).items() if count} == {cause}
    assert measure(record).infractions_untold == (cause != "told in time")


@given(st.lists(st.tuples(st.floats(0.0, 30.0), st.sampled_from((None, 8.0, 20.0)), st.integers(1, 40)), max_size=12))
def test_as_many_are_found_as_count_as_infractions(pieces: list[tuple[float, float | None, int]]) -> None:
    steps = [(speed, limit) for speed, limit, count in pieces for _ in range(count)]

    def at(time_s: float) -> dict[str, Any]:
        speed, limit = steps[round(time_s / 0.05) - 1]
        return {"speed_mps": speed, "law_limit_mps": limit}

    record = Record(truths=truths(len(steps) * 0.05, at))
    assert len(list(speedings(record))) == speeding_episodes(record)
