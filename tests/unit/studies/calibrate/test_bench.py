"""Scripted approaches: what guards cost."""

import msgspec
import pytest

from services.arbiter.braking.act import Permission
from studies.calibrate.bench import APPROACHES, impact_mps, mean_impact_mps
from tests.unit.services.arbiter.support import CALIBRATED, PAPER

COASTING = {"a car stands, town": 10.0, "a car stands, 50 km/h": 14.0, "somebody steps out": 11.0}


@pytest.mark.parametrize("approach", [each for each in APPROACHES if each.name in COASTING], ids=lambda each: each.name)
def test_who_never_brakes_meets_a_standing_car_at_full_speed(approach: object) -> None:
    assert impact_mps(approach, PAPER) == pytest.approx(COASTING[approach.name])  # type: ignore[attr-defined, arg-type]


@pytest.mark.parametrize("approach", APPROACHES, ids=lambda each: each.name)
def test_the_shipped_constants_never_make_it_worse(approach: object) -> None:
    assert impact_mps(approach, CALIBRATED) <= impact_mps(approach, PAPER)  # type: ignore[arg-type]


def test_the_shipped_constants_take_speed_off_and_stricter_guards_less() -> None:
    strict = msgspec.structs.replace(CALIBRATED, act_watched_s=0.65, act_track_age_s=1.2, act_confidence=0.9)
    blind = msgspec.structs.replace(CALIBRATED, act_confidence=0.95)
    means = [mean_impact_mps(profile) for profile in (CALIBRATED, strict, blind)]
    assert means == sorted(means)
    assert means[0] < 0.75 * means[2]
    assert means[2] == pytest.approx(mean_impact_mps(PAPER)), "nobody is surely enough seen"


def test_the_car_brakes_no_harder_than_the_grant_allows() -> None:
    assert Permission().refused
    start = next(each for each in APPROACHES if each.name == "a car stands, 50 km/h")
    # 2 s at no more than 4 m/s^2 take at most 8 m/s off
    assert impact_mps(start, CALIBRATED) >= 14.0 - 8.0 - 0.5
