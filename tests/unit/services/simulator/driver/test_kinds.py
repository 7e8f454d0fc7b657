"""The kinds of drivers: what a population does about a lead and a person, and when."""

from dataclasses import replace
from statistics import median

import pytest

from services.simulator.driver.driver import Advice, Driver, DriverView
from services.simulator.driver.kinds import BRAKES_MPS2, GLANCE_S, SURPRISED_S, DriverKind, new_driver, profile_of
from services.simulator.driver.profile import draw_driver

DT = 0.05
SEEDS = range(1, 200)
ROAD = DriverView(time_s=0.0, speed_mps=15.0, mu=0.9, wet=False)
STANDS_NEAR = replace(ROAD, gap_m=20.0, lead_mps=0.0)
STEPS_OUT = replace(ROAD, person_m=25.0)
BRAKES = -1.5
"""More than a foot off the pedal (m/s2)."""
WARNING = Advice(topic="pedestrian", target_mps=None, warns=True)


def first_braking_s(driver: Driver, view: DriverView, below_mps2: float = -0.3) -> float:
    """When his wish first falls below the threshold, on an unchanging road."""
    for step in range(200):
        if driver.drive(replace(view, time_s=step * DT), DT).acceleration_mps2 < below_mps2:
            return step * DT
    return float("inf")


def hardest_mps2(driver: Driver, view: DriverView) -> float:
    return -min(driver.drive(replace(view, time_s=step * DT), DT).acceleration_mps2 for step in range(200))


def test_the_drawn_driver_is_the_one_of_the_seed() -> None:
    assert all(profile_of("drawn", seed) == draw_driver(seed) for seed in SEEDS)


def test_the_absent_driver_does_nothing() -> None:
    driver = new_driver("absent", 1, 15.0)
    driver.hear(WARNING, 0.0)
    assert first_braking_s(driver, STEPS_OUT) == float("inf")


def test_an_absent_driver_may_have_a_foot_on_the_pedal() -> None:
    driver = new_driver("absent", 1, 15.0, absent_mps2=1.5)
    wish = driver.drive(STEPS_OUT, DT)
    assert wish.acceleration_mps2 == 1.5
    assert wish.accelerator > 0.0


def test_the_attentive_driver_never_looks_away_and_brakes_as_hard_as_the_road_allows() -> None:
    driver = new_driver("attentive", 3, 15.0)
    assert not any(driver.distracted(each) for each in range(3600))
    near = replace(STEPS_OUT, person_m=8.0)
    assert hardest_mps2(driver, near) > BRAKES_MPS2 + 1.0


def test_the_obedient_driver_follows_every_word_and_drives_no_faster_than_allowed() -> None:
    for seed in SEEDS:
        profile = profile_of("obedient", seed)
        assert profile.compliance == 1.0
        assert profile.speed_bias <= 1.0
        assert profile.notices == draw_driver(seed).notices, "what is overlooked has to be told"


@pytest.mark.parametrize("kind", ["startled", "slow"])
def test_surprised_drivers_do_nothing_about_a_lead_before_they_have_reacted(kind: DriverKind) -> None:
    for seed in range(1, 10):
        profile = profile_of(kind, seed)
        limit_mps = ROAD.speed_mps / profile.speed_bias  # drives as fast as he likes
        begins = first_braking_s(new_driver(kind, seed, limit_mps), STANDS_NEAR, BRAKES)
        reacts = profile.glance_s + profile.reaction_s
        assert reacts - DT <= begins <= reacts + 0.5
        attentive_s = first_braking_s(new_driver("attentive", seed, limit_mps), STANDS_NEAR, BRAKES)
        reacts_s = profile_of("attentive", seed).reaction_s
        assert reacts_s - DT <= attentive_s <= reacts_s + 0.5


def test_their_reactions_and_braking_are_as_published() -> None:
    startled, slow = ([profile_of(kind, seed) for seed in SEEDS] for kind in ("startled", "slow"))
    assert median(each.reaction_s for each in startled) == pytest.approx(SURPRISED_S, abs=0.1)
    assert median(each.reaction_s + each.glance_s for each in slow) == pytest.approx(3.5, abs=0.1)
    assert median(each.brakes_mps2 for each in startled) == pytest.approx(BRAKES_MPS2, abs=0.2)
    weak = sum(each.brakes_mps2 < 3.4 for each in startled) / len(startled)
    assert 0.05 <= weak <= 0.15


@pytest.mark.parametrize("kind", ["startled", "slow"])
def test_surprised_drivers_brake_no_harder_than_they_do(kind: DriverKind) -> None:
    for seed in range(1, 10):
        hardest = hardest_mps2(new_driver(kind, seed, 15.0), replace(STEPS_OUT, person_m=8.0))
        assert hardest == pytest.approx(profile_of(kind, seed).brakes_mps2)


def test_a_warning_brings_the_slow_drivers_eyes_back() -> None:
    unwarned, warned = (new_driver("slow", 5, 15.0) for _ in range(2))
    warned.hear(WARNING, 0.0)
    assert first_braking_s(warned, STEPS_OUT) <= first_braking_s(unwarned, STEPS_OUT) - GLANCE_S
