"""A sign is missed or misread all along its way past, by whichever camera and under whichever track it is seen."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.corruption.corruptor import Corruptor
from evaluation.corruption.spec import CorruptionSpec
from proto import topics
from proto.scene import Candidate, Fact, Facts
from proto.truth import Corrupted
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from services.orchestrator.signs.signs import consistent, known_code, plausible_value
from tests.unit.evaluation.corruption.worlds import ORIGIN, SOME, TICK, drive, facts_after, limit, post, said, truth

SEEDS = st.integers(0, 10**6)
MISREAD = CorruptionSpec(limit_misread=1.0)


def along(spec: CorruptionSpec, *, true: bool, switch: bool = True) -> list[tuple[Fact, ...]]:
    """A limit of 80 passed at 20 m/s; both cameras see it, distances wrong by a tenth, and the tele's track switches."""
    corruptor, out = Corruptor(spec), []
    for number in range(28):
        at_ns, left_m = ORIGIN + number * TICK, 60.0 - 2.0 * number
        corruptor.moved(20.0, at_ns)
        if true:
            corruptor.truth(truth(number / 10, signs=(post(5, left_m), post(6, left_m + 60.0, "limit:60"))), at_ns)
        off = 1.1 if number % 2 else 0.9
        tele = limit(track_id=8 if switch and number > 12 else 7, at_ns=at_ns, distance_m=left_m * off)
        front = limit(camera="front", track_id=3, at_ns=at_ns, distance_m=left_m / off, lateral_m=-2.5)
        out.append(facts_after(corruptor, tele, front) if left_m < 45.0 else facts_after(corruptor, tele))
    return out


@SOME
@given(SEEDS, st.booleans())
def test_a_sign_is_missed_as_a_whole_or_not_at_all(seed: int, true: bool) -> None:
    left = along(CorruptionSpec(seed=seed, sign_miss=0.5), true=true)
    assert left == [()] * 28 or [len(facts) for facts in left] == [1] * 8 + [2] * 20


@SOME
@given(SEEDS, st.booleans())
def test_a_misreading_is_one_all_along_and_believed_as_before(seed: int, true: bool) -> None:
    facts = [fact for row in along(CorruptionSpec(seed=seed, limit_misread=1.0), true=true) for fact in row]
    assert len({(fact.reading, fact.value, fact.unit) for fact in facts}) == 1
    assert facts[0] != limit()
    assert all(fact.confidence == 0.97 and fact.believed and consistent(fact) for fact in facts)
    assert (facts[0].value == 80.0) == (facts[0].unit == "mph")


@SOME
@given(SEEDS, st.sampled_from(["limit", "zone", "led"]), st.sampled_from([20, 30, 50, 70, 80, 100, 130]))
def test_a_misread_limit_is_another_one_that_the_country_shows(seed: int, head: str, value: int) -> None:
    spec = CorruptionSpec(seed=seed, limit_misread=1.0, misread_unit=0.0)
    _, after = facts_after(Corruptor(spec), said("jurisdiction", "DEU"), limit(value, reading=f"{head}:{value}"))
    assert after.value is not None
    assert after.reading == f"{head}:{after.value:.0f}"
    assert after.value != value
    assert after.value in allowed_limits("DEU", "km/h")
    assert known_code(after.reading)
    assert plausible_value(after.value)


def test_a_doubted_limit_keeps_its_doubt_under_the_new_name() -> None:
    candidates = (Candidate(reading="limit:80", confidence=0.5), Candidate(reading="limit:60", confidence=0.3))
    doubted = limit(80, believed=False, confidence=0.5, candidates=candidates)
    (after,) = facts_after(Corruptor(CorruptionSpec(limit_misread=1.0, misread_unit=0.0)), doubted)
    assert not after.believed
    assert [each.confidence for each in after.candidates] == [0.5, 0.3]
    assert after.candidates[0].reading == after.reading != "limit:80"


@pytest.mark.parametrize(
    "fact",
    [
        said("light", "light:red"),
        said("jurisdiction", "GBR"),
        said("units", "mph"),
    ],
)
def test_lights_and_what_follows_from_many_signs_are_left(fact: Fact) -> None:
    assert facts_after(Corruptor(CorruptionSpec(sign_miss=1.0, limit_misread=1.0)), fact) == (fact,)


@pytest.mark.parametrize("fact", [said("sign", "stop"), said("limit", "limit_end", scope="end")])
def test_what_shows_no_number_is_never_misread(fact: Fact) -> None:
    assert facts_after(Corruptor(MISREAD), fact) == (fact,)


@pytest.mark.parametrize(
    ("name", "rate"), [("sign_miss", 0.1), ("sign_miss", 0.3), ("limit_misread", 0.1), ("limit_misread", 0.5)]
)
def test_over_many_signs_the_rate_is_the_one_asked_for(name: str, rate: float) -> None:
    corruptor = Corruptor(CorruptionSpec(**{"seed": 3, name: rate}))  # type: ignore[arg-type]
    count, told = 3000, list[Corrupted]()
    for number in range(count):
        at_ns = ORIGIN + number * 60 * TICK
        corruptor.truth(truth(number * 6.0, signs=(post(number, 60.0),)), at_ns)
        facts = Facts(facts=(limit(track_id=number, at_ns=at_ns),))
        told += corruptor.leave(topics.FACTS, facts, "drivelm", at_ns).records
    assert len(told) == count
    hits = sum(record.hit for record in told)
    assert abs(hits / count - rate) < 4.0 * (rate * (1 - rate) / count) ** 0.5


@SOME
@given(SEEDS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_what_a_low_rate_corrupts_a_high_one_corrupts_alike(seed: int, one: float, other: float) -> None:
    low, high = sorted((one, other))
    signs = [limit(track_id=number, distance_m=None) for number in range(20)]
    low_after, high_after = (
        [facts_after(Corruptor(CorruptionSpec(seed=seed, limit_misread=rate)), sign)[0] for sign in signs]
        for rate in (low, high)
    )
    assert all(b in (a, c) for a, b, c in zip(signs, low_after, high_after, strict=True))
    assert all(c == b for a, b, c in zip(signs, low_after, high_after, strict=True) if b != a)


def test_truth_names_signs_alike_in_drives_that_see_them_otherwise() -> None:
    def subjects(track_id: int, distance_m: float) -> list[str]:
        corruptor = Corruptor(CorruptionSpec(sign_miss=0.5))
        corruptor.truth(truth(signs=(post(5, 40.0), post(6, 95.0, "limit:60"))), ORIGIN)
        facts = Facts(facts=(limit(track_id=track_id, distance_m=distance_m),))
        return [record.subject for record in corruptor.leave(topics.FACTS, facts, "drivelm", ORIGIN).records]

    assert subjects(4, 37.0) == subjects(90, 44.0) == ["sign/5"]


def test_every_encounter_is_told_once_with_what_it_became() -> None:
    rows = drive(CorruptionSpec(seed=1, sign_miss=0.5, limit_misread=1.0), 170)
    told = [record for row in rows for left in row for record in left.records]
    assert sorted(record.subject for record in told if record.kind == "sign_miss") == [f"sign/{i}" for i in range(4)]
    spared = {record.subject for record in told if record.kind == "sign_miss" and not record.hit}
    misread = {record.subject: record for record in told if record.kind == "limit_misread"}
    assert set(misread) == spared
    assert all(record.before == "limit:80 km/h" != record.after for record in misread.values())
    assert all(msgspec.json.decode(msgspec.json.encode(record), type=type(record)) == record for record in told)
