"""What is fitted is found again."""

import math

import numpy as np

from evaluation.modelled_sensors.card import SPREADS, Card
from evaluation.modelled_sensors.noise import Chain, Drift
from evaluation.modelled_sensors.sight import Thing
from proto.perception import Box
from services.simulator.session import CAMERAS
from studies.modelled_sensors.imagined import imagine
from studies.modelled_sensors.pairing import Look, looks
from studies.modelled_sensors.ranging import ranging
from tests.unit.studies.modelled_sensors.support import NS, car, drawn, truth
from training.regression import linear, logistic, memory_s


def test_a_chain_keeps_its_share_and_its_memory() -> None:
    chain, states = Chain(1), []
    for k in range(6000):
        states.append(chain.at("a", k * NS // 10, 0.7, 0.5))
    told = np.array(states, float)
    assert abs(told.mean() - 0.7) < 0.05
    assert 0.7 < np.corrcoef(told[1:], told[:-1])[0, 1] < 0.9, "exp(-0.1 / 0.5) = 0.82"
    times = np.arange(len(told)) / 10
    assert 0.3 < memory_s([(times, told - 0.7, np.full(len(told), 0.46))]) < 0.8


def test_drift_is_normal_and_alike_from_picture_to_picture() -> None:
    drift = Drift(1)
    told = np.array([drift.at("height", "a", k * NS // 10, 0.4) for k in range(6000)])
    assert abs(told.mean()) < 0.15
    assert 0.9 < told.std() < 1.1
    assert 0.7 < np.corrcoef(told[1:], told[:-1])[0, 1] < 0.86, "exp(-0.1 / 0.4) = 0.78"


def test_lines_are_found_again() -> None:
    random = np.random.default_rng(1)
    x = np.stack([np.ones(4000), random.normal(size=4000)], axis=1)
    odds = x @ np.array([0.5, 2.0])
    ridge = np.array([1e-3, 1.0])
    found = logistic(x, (random.random(4000) < 1 / (1 + np.exp(-odds))).astype(float), ridge)
    assert np.allclose(found, (0.5, 2.0), atol=0.2)
    y = odds + 0.1 * random.normal(size=4000)
    y[::50] += 30.0
    weights, spread = linear(x, y, ridge)
    assert np.allclose(weights, (0.5, 2.0), atol=0.05), "wild ones do not count"
    assert 0.08 < spread < 0.13


def test_boxes_that_were_drawn_are_paired_with_what_they_are_of(card: Card) -> None:
    steps = [(NS + k * NS // 10, truth(k / 10, car(1, 30.0))) for k in range(30)]
    told = [imagine(drawn(steps), card, seed) for seed in range(6)]
    seen = [look for each in told for found, _ in looks(each) for look in found if look.thing.key == "actor/1"]
    assert sum(each.box is not None for each in seen) > 0.8 * len(seen)
    followed = sum(
        any(abs(track.x_m - 30.0) < 3.0 for track in tracks.tracks) for each in told for _, tracks in each.tracks
    )
    assert followed > 0.8 * 6 * 30


def test_range_errors_are_found_again_with_what_is_each_things_own() -> None:
    random = np.random.default_rng(2)
    things_own = {number: 0.004 * random.normal() for number in range(60)}
    told = [
        look(number, k, (1.0 + things_own[number] + 0.003 * random.normal()) * 30.0)
        for number in things_own
        for k in range(30)
    ]
    errors = ranging(told).errors["small free"]
    middle = [quantile for step, quantile in zip(SPREADS, errors.quantiles, strict=True) if abs(step) == 1.0]
    assert np.allclose(middle, (-0.005, 0.005), atol=0.0015), "a spread of 0.005 in all"
    assert 0.45 < errors.own < 0.8, "16 of 25 parts of the variance"


def test_what_hides_a_thing_has_range_errors_of_its_own() -> None:
    told = [look(1, k, 30.0) for k in range(50)] + [look(2, k, 24.0, hidden=0.7) for k in range(50)]
    errors = ranging(told).errors
    assert max(map(abs, errors["small free"].quantiles)) < 1e-6
    assert np.allclose(errors["small hidden"].quantiles, -0.2)


def look(number: int, k: int, range_m: float, hidden: float = 0.0) -> Look:
    """A vehicle that stands 30 m ahead in the middle of the picture, with a measured range."""
    camera, at = CAMERAS["front"], (320.0, 170.0, 340.0, 190.0)
    thing = Thing("vehicle", f"actor/{number}", "vehicle", 30.0, at, 20.0, hidden)
    u, v = (330.0 - camera.width_px / 2) / camera.focal_px, (180.0 - camera.height_px / 2) / camera.focal_px
    box = Box(
        x0_px=at[0], y0_px=at[1], x1_px=at[2], y1_px=at[3], kind="vehicle", score=0.9,
        range_m=range_m * math.hypot(1.0, u, v), range_source="lidar",
    )  # fmt: skip
    return Look("front", NS + k * NS // 10, thing, (0.0, 0.0, 0.0), box)
