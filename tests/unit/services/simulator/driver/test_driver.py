"""The driver: what he makes of advice, signs, lines and people, and when."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.simulator.driver.driver import Advice, Driver, DriverView, StopAhead
from services.simulator.driver.profile import MEDIAN_REACTION_S, DriverProfile, draw_driver

DT = 0.05
CALM = DriverProfile(
    reaction_s=1.2,
    compliance=1.0,
    speed_bias=1.0,
    notices=1.0,
    misses_stop=0.0,
    distracted_every_s=1e9,
    wet_slowdown=1.0,
    seed=3,
)
ROAD = DriverView(time_s=0.0, speed_mps=25.0, mu=0.8, wet=False)
SLOWER = Advice(topic="limit", target_mps=13.9)
SLOWER_LIMIT = replace(SLOWER, limit_mps=13.9)


def first_braking_s(driver: Driver, view: DriverView, until_s: float = 6.0, below_mps2: float = -0.3) -> float | None:
    """When his wish first falls below the threshold, on an unchanging road."""
    time_s = 0.0
    while time_s < until_s:
        if driver.drive(replace(view, time_s=time_s), DT).acceleration_mps2 < below_mps2:
            return time_s
        time_s += DT
    return None


def test_advice_is_obeyed_after_the_reaction_time_and_not_before() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(SLOWER, 0.0)
    begins = first_braking_s(driver, ROAD)
    assert begins is not None
    assert CALM.reaction_s <= begins < CALM.reaction_s + 0.3


def test_without_advice_he_keeps_to_what_he_believes() -> None:
    assert first_braking_s(Driver(CALM, believed_mps=25.0), ROAD) is None


def test_who_never_complies_does_not_change() -> None:
    driver = Driver(replace(CALM, compliance=0.0), believed_mps=25.0)
    driver.hear(SLOWER, 0.0)
    assert first_braking_s(driver, ROAD) is None


def test_the_same_message_said_again_meets_the_same_mind() -> None:
    def minds(seed: int) -> set[bool]:
        driver, found = Driver(replace(CALM, compliance=0.5, seed=seed), believed_mps=25.0), set()
        for said_s in range(0, 1200, 60):  # long enough apart for the last one to have worn off
            driver.hear(SLOWER, float(said_s))
            found.add(driver.wanted_mps(replace(ROAD, time_s=said_s + 5.0)) < 20.0)
        return found

    met = [minds(seed) for seed in range(20)]
    assert all(len(found) == 1 for found in met)
    assert set.union(*met) == {False, True}


@pytest.mark.parametrize(
    ("one", "another"),
    [
        (
            Advice(topic="limit", target_mps=13.9, limit_mps=13.9),
            Advice(topic="ahead", target_mps=20.0, ahead_mps=13.9),
        ),
        (
            Advice(topic="limit", target_mps=13.9, limit_mps=13.9),
            Advice(topic="border", target_mps=9.0, limit_mps=13.9),
        ),
        (Advice(topic="friction", target_mps=13.9), Advice(topic="friction", target_mps=11.0)),
    ],
)
def test_more_words_on_one_matter_convince_no_more(one: Advice, another: Advice) -> None:
    def obeys(seed: int, *said: Advice) -> bool:
        driver = Driver(replace(CALM, compliance=0.5, seed=seed), believed_mps=25.0)
        for each in said:
            driver.hear(each, 0.0)
        driver.drive(replace(ROAD, time_s=5.0), DT)
        return driver.wanted_mps(replace(ROAD, time_s=5.0)) < 20.0

    alone = [obeys(seed, one) for seed in range(40)]
    assert [obeys(seed, another) for seed in range(40)] == alone
    assert [obeys(seed, another, one) for seed in range(40)] == alone
    assert 8 < sum(alone) < 32


def test_another_limit_meets_a_mind_of_its_own() -> None:
    minds = set()
    for seed in range(20):
        driver = Driver(replace(CALM, compliance=0.5, seed=seed), believed_mps=25.0)
        driver.hear(SLOWER_LIMIT, 0.0)
        obeyed = driver.wanted_mps(replace(ROAD, time_s=10.0)) < 20.0
        driver.hear(replace(SLOWER_LIMIT, target_mps=8.3, limit_mps=8.3), 60.0)
        minds.add((obeyed, driver.wanted_mps(replace(ROAD, time_s=70.0)) < 10.0))
    assert len(minds) == 4


def test_advice_wears_off_when_nobody_repeats_it() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(SLOWER, 0.0)
    assert driver.wanted_mps(replace(ROAD, time_s=5.0)) == pytest.approx(13.9)
    assert driver.wanted_mps(replace(ROAD, time_s=60.0)) == pytest.approx(25.0)


def test_a_warning_wears_off_sooner_than_a_limit() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(Advice(topic="vulnerable_road_user", target_mps=5.0, warns=True), 0.0)
    assert driver.wanted_mps(replace(ROAD, time_s=3.0)) == pytest.approx(5.0)
    assert driver.wanted_mps(replace(ROAD, time_s=8.0)) == pytest.approx(25.0)


def test_a_target_for_who_drives_before_him_wears_off_as_soon_and_the_limit_told_with_it_stays() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(Advice(topic="limit", target_mps=2.0, limit_mps=20.0, seen=True), 0.0)
    assert driver.wanted_mps(replace(ROAD, time_s=3.0)) == pytest.approx(2.0)
    driver.drive(replace(ROAD, time_s=3.0), 0.05)
    assert driver.wanted_mps(replace(ROAD, time_s=8.0)) == pytest.approx(20.0)


def test_a_warned_driver_brakes_earlier_for_somebody_on_the_road() -> None:
    view = replace(ROAD, person_m=30.0)
    alone, warned = Driver(CALM, 25.0), Driver(CALM, 25.0)
    warned.hear(Advice(topic="vru", target_mps=None, warns=True), 0.0)
    late, early = first_braking_s(alone, view), first_braking_s(warned, view)
    assert late is not None
    assert early is not None
    assert early < late - 0.3
    assert late >= CALM.reaction_s


@pytest.mark.parametrize(("speed_mps", "way_m"), [(4.4, 30.0), (7.0, 60.0), (8.3, 90.0), (14.0, 60.0)])
def test_his_foot_does_not_tremble_as_he_comes_to_somebody(speed_mps: float, way_m: float) -> None:
    driver = Driver(CALM, speed_mps)
    wishes: list[float] = []
    while speed_mps > 0.05 and len(wishes) * DT < 60.0:
        view = replace(ROAD, time_s=len(wishes) * DT, speed_mps=speed_mps, person_m=way_m)
        wishes.append(driver.drive(view, DT).acceleration_mps2)
        speed_mps, way_m = speed_mps + wishes[-1] * DT, way_m - speed_mps * DT
    changes = [after - before for before, after in pairwise(wishes)]
    assert sum(one * next_one < -1e-6 for one, next_one in pairwise(changes)) <= 3
    assert speed_mps <= 0.05
    assert way_m > 2.0


def test_braking_is_bounded_by_grip() -> None:
    driver, lowest = Driver(CALM, 25.0), 0.0
    view = replace(ROAD, person_m=6.0, mu=0.3)
    for step in range(80):
        lowest = min(lowest, driver.drive(replace(view, time_s=step * DT), DT).acceleration_mps2)
    assert lowest == pytest.approx(-0.3 * 9.81, abs=0.05)


def test_signs_are_read_only_by_who_notices_and_understands_them() -> None:
    seen = replace(ROAD, passed=((4, 13.9, True),))
    foreign = replace(ROAD, passed=((4, 13.9, False),))
    attentive, blind, abroad = Driver(CALM, 25.0), Driver(replace(CALM, notices=0.0), 25.0), Driver(CALM, 25.0)
    attentive.drive(seen, DT)
    blind.drive(seen, DT)
    abroad.drive(foreign, DT)
    assert (attentive.believed_mps, blind.believed_mps, abroad.believed_mps) == (13.9, 25.0, 25.0)


ANNOUNCED = Advice(topic="ahead", target_mps=24.0, ahead_mps=13.9)
INATTENTIVE = replace(CALM, notices=0.0, speed_bias=1.1)


@pytest.mark.parametrize("understood", [True, False])
def test_who_was_told_of_a_sign_sees_it(understood: bool) -> None:
    driver = Driver(INATTENTIVE, believed_mps=25.0)
    driver.hear(ANNOUNCED, 0.0)
    driver.drive(replace(ROAD, time_s=3.0, passed=((4, 19.4, understood),)), DT)
    assert driver.believed_mps == 25.0
    driver.drive(replace(ROAD, time_s=4.0, passed=((5, 13.9, understood),)), DT)
    assert driver.believed_mps == 13.9


def test_what_he_heard_less_than_his_reaction_time_before_a_sign_makes_him_look_for_nothing() -> None:
    driver = Driver(INATTENTIVE, believed_mps=25.0)
    driver.hear(ANNOUNCED, 0.0)
    driver.drive(replace(ROAD, time_s=0.9 * CALM.reaction_s, passed=((4, 13.9, True),)), DT)
    assert driver.believed_mps == 25.0


def test_who_does_not_heed_what_he_is_told_does_not_look_for_the_sign() -> None:
    driver = Driver(replace(INATTENTIVE, compliance=0.0), believed_mps=25.0)
    driver.hear(ANNOUNCED, 0.0)
    driver.drive(replace(ROAD, time_s=4.0, passed=((4, 13.9, True),)), DT)
    assert driver.believed_mps == 25.0


def test_at_its_sign_he_keeps_to_the_limit_that_he_was_told_to_slow_down_for_until_the_next_sign() -> None:
    driver = Driver(replace(CALM, speed_bias=1.1), believed_mps=25.0)
    driver.hear(replace(ANNOUNCED, slow=True), 0.0)
    driver.drive(replace(ROAD, time_s=0.5, passed=((4, 13.9, True),)), DT)
    assert driver.wanted_mps(replace(ROAD, time_s=4.0)) == pytest.approx(13.9)
    driver.drive(replace(ROAD, time_s=5.0, passed=((5, 22.2, True),)), DT)
    assert driver.wanted_mps(replace(ROAD, time_s=5.0)) == pytest.approx(1.1 * 22.2)


def test_a_sign_on_the_way_to_the_announced_one_does_not_make_him_forget_it() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(ANNOUNCED, 0.0)
    driver.drive(replace(ROAD, time_s=3.0, passed=((4, 19.4, True),)), DT)
    assert driver.wanted_mps(replace(ROAD, time_s=4.0)) == pytest.approx(13.9)


def test_a_limit_heard_before_a_sign_does_not_outdo_the_sign_that_he_read_meanwhile() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(Advice(topic="limit", target_mps=27.8, limit_mps=27.8), 0.0)
    driver.drive(replace(ROAD, time_s=0.5, passed=((4, 19.4, True),)), DT)
    driver.drive(replace(ROAD, time_s=4.0), DT)
    assert driver.believed_mps == 19.4


def test_a_sign_ends_no_warning() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(Advice(topic="lead", target_mps=8.0, warns=True), 0.0)
    driver.drive(replace(ROAD, time_s=2.0, passed=((4, 27.8, True),)), DT)
    assert driver.wanted_mps(replace(ROAD, time_s=2.1)) == pytest.approx(8.0)


def test_he_comes_to_a_stand_before_a_red_light() -> None:
    driver, speed, place = Driver(CALM, 14.0), 14.0, 0.0
    for step in range(400):
        view = replace(ROAD, time_s=step * DT, speed_mps=speed, stop=StopAhead(key=1, distance_m=80.0 - place))
        speed = max(0.0, speed + driver.drive(view, DT).acceleration_mps2 * DT)
        place += speed * DT
    assert speed < 0.05
    assert 76.0 < place < 80.2


def test_drivers_of_different_seeds_differ_and_of_one_seed_do_not() -> None:
    assert draw_driver(1) == draw_driver(1)
    assert len({draw_driver(seed).reaction_s for seed in range(20)}) == 20
    assert all(0.5 < draw_driver(seed).compliance <= 1.0 for seed in range(50))


def test_the_population_is_the_published_one() -> None:
    drivers = [draw_driver(seed) for seed in range(3000)]
    reaction = np.array([each.reaction_s for each in drivers])
    assert np.median(reaction) == pytest.approx(MEDIAN_REACTION_S, abs=0.02)
    # Lerner 1993: mean 1.5 s, 85th percentile 1.9 s, a ratio of 1.27.
    assert np.quantile(reaction, 0.85) / reaction.mean() == pytest.approx(1.9 / 1.5, abs=0.03)
    bias = np.array([each.speed_bias for each in drivers])
    # Department for Transport 2022, motorways: 45 % above the limit, 8 % by 10 mph of 70 or more; 30 mph roads: 50 %.
    assert 0.44 < (bias > 1.0).mean() < 0.54
    assert 0.06 < (bias > 80 / 70).mean() < 0.12
    # Schirokoff and Luoma 2005: 63 to 73 %.
    assert 0.63 < np.mean([each.notices for each in drivers]) < 0.73
    # Hranac et al. 2006: 2 to 9 %.
    assert all(0.91 <= each.wet_slowdown <= 0.98 for each in drivers)


def test_who_drives_does_not_depend_on_what_he_is_told() -> None:
    told, alone = Driver(draw_driver(7), 25.0), Driver(draw_driver(7), 25.0)
    for second in range(0, 60, 7):
        told.hear(SLOWER, float(second))
    assert told.profile == alone.profile
    assert [told.distracted(t / 2) for t in range(200)] == [alone.distracted(t / 2) for t in range(200)]


def test_who_is_told_of_a_lower_limit_ahead_comes_down_to_it() -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(Advice(topic="ahead", target_mps=24.0, ahead_mps=13.9), 0.0)
    assert driver.wanted_mps(replace(ROAD, time_s=0.5 * CALM.reaction_s)) == 25.0
    assert driver.wanted_mps(replace(ROAD, time_s=1.1 * CALM.reaction_s)) == pytest.approx(13.9)


def test_who_is_told_to_slow_down_goes_to_the_limit_itself_and_not_to_what_he_makes_of_it() -> None:
    hasty = replace(CALM, speed_bias=1.1)
    announced, told = Driver(hasty, believed_mps=25.0), Driver(hasty, believed_mps=25.0)
    announced.hear(Advice(topic="ahead", target_mps=24.0, ahead_mps=13.9), 0.0)
    told.hear(Advice(topic="ahead", target_mps=24.0, ahead_mps=13.9, slow=True), 0.0)
    later = replace(ROAD, time_s=2.0)
    assert announced.wanted_mps(later) == pytest.approx(1.1 * 13.9)
    assert told.wanted_mps(later) == pytest.approx(13.9)


@given(
    first_mps=st.floats(2.0, 24.0),
    second_mps=st.floats(2.0, 24.0),
    gap_s=st.floats(0.0, 10.0),
    topics=st.tuples(st.sampled_from(["ahead", "limit"]), st.sampled_from(["ahead", "limit"])),
)
def test_until_he_acts_on_a_new_word_he_keeps_to_the_former(
    first_mps: float, second_mps: float, gap_s: float, topics: tuple[str, str]
) -> None:
    driver = Driver(CALM, believed_mps=25.0)
    driver.hear(Advice(topic=topics[0], target_mps=first_mps), 0.0)
    driver.hear(Advice(topic=topics[1], target_mps=second_mps), CALM.reaction_s + gap_s)
    acts_s = 2 * CALM.reaction_s + gap_s
    assert driver.wanted_mps(replace(ROAD, time_s=acts_s - 0.01)) == pytest.approx(first_mps, abs=0.31)
    after = second_mps if topics[0] == topics[1] else min(first_mps, second_mps)
    assert driver.wanted_mps(replace(ROAD, time_s=acts_s + 0.01)) == pytest.approx(after, abs=0.31)


def behind(
    driver: Driver, brakes_s: float, brakes_mps2: float, until_s: float = 30.0
) -> tuple[list[float], list[float]]:
    """Wishes and gaps behind a lead at the same speed that brakes from an instant on, until it stands."""
    speed, lead, gap = 20.0, 20.0, 40.0
    wishes, gaps = list[float](), list[float]()
    while len(wishes) * DT < until_s:
        now = len(wishes) * DT
        view = replace(ROAD, time_s=now, speed_mps=speed, gap_m=gap, lead_mps=lead)
        wishes.append(driver.drive(view, DT).acceleration_mps2)
        speed = max(0.0, speed + wishes[-1] * DT)
        lead = max(0.0, lead - brakes_mps2 * DT) if now >= brakes_s else lead
        gap += (lead - speed) * DT
        gaps.append(gap)
    return wishes, gaps


@given(reaction_s=st.floats(0.7, 2.5), brakes_mps2=st.floats(0.5, 2.0))
def test_a_lead_that_brakes_gently_is_answered_after_the_reaction_time_and_not_before(
    reaction_s: float, brakes_mps2: float
) -> None:
    profile = replace(CALM, reaction_s=reaction_s)
    braked, _ = behind(Driver(profile, 25.0), 10.0, brakes_mps2)
    steady, _ = behind(Driver(profile, 25.0), 1e9, 0.0)
    differs_s = next(
        at * DT for at, pair in enumerate(zip(braked, steady, strict=True)) if abs(pair[0] - pair[1]) > 1e-3
    )
    assert 10.0 + reaction_s - DT <= differs_s <= 10.0 + reaction_s + 0.3


@pytest.mark.parametrize("reaction_s", [0.7, 1.25, 2.5])
def test_a_late_follower_neither_sways_behind_a_steady_lead_nor_meets_one_that_brakes(reaction_s: float) -> None:
    profile = replace(CALM, reaction_s=reaction_s)
    wishes, _ = behind(Driver(profile, 25.0), 1e9, 0.0, 60.0)
    assert max(map(abs, wishes[-200:])) < 0.05
    _, gaps = behind(Driver(profile, 25.0), 20.0, 2.0, 60.0)
    assert min(gaps) > 0.5


def noticed_m(driver: Driver, sign: tuple[int, float, bool], until_m: float) -> float | None:
    """How far behind a sign the driver believes in its limit; None: not by then."""
    driver.drive(replace(ROAD, passed=(sign,)), DT)
    for step in range(1, int(until_m / (ROAD.speed_mps * DT))):
        if driver.believed_mps == sign[1]:
            return step * ROAD.speed_mps * DT
        driver.drive(replace(ROAD, time_s=step * DT), DT)
    return None


@pytest.mark.parametrize("understood", [True, False])
def test_an_overlooked_limit_is_noticed_later_and_by_each_seed_at_one_place(understood: bool) -> None:
    def places() -> list[float | None]:
        drivers = [Driver(replace(CALM, notices=0.6, seed=seed), 25.0) for seed in range(30)]
        return [noticed_m(each, (4, 13.9, understood), 8000.0) for each in drivers]

    found = places()
    assert None not in found
    later = [each for each in found if each is not None and each > 10.0]
    assert later
    assert all((each - 500.0) % 900.0 == pytest.approx(0.0, abs=5.0) for each in later)
    assert len({round(each, -2) for each in later}) >= 2
    assert found == places()


def test_the_next_sign_replaces_an_overlooked_one() -> None:
    driver = Driver(replace(CALM, notices=0.0), 25.0)
    driver.drive(replace(ROAD, passed=((4, 13.9, True),)), DT)
    driver.hear(replace(ANNOUNCED, ahead_mps=19.4), 0.0)
    driver.drive(replace(ROAD, time_s=5.0, passed=((5, 19.4, True),)), DT)
    driver.profile = replace(CALM, notices=1.0)
    for step in range(2000):
        driver.drive(replace(ROAD, time_s=5.0 + step * DT), DT)
    assert driver.believed_mps == 19.4
