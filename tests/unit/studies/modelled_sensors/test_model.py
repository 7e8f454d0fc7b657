"""Modelled sensors: drawn by seed and by what is asked, shaped as fitted, and carried by production's services."""

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest

from drivemcp.errors import UserError
from drivemcp.paths import data
from evaluation.modelled_sensors.boxes import SCORE_FLOOR, SCORE_FLOORS, Eye
from evaluation.modelled_sensors.card import Card, Line, read_card
from evaluation.modelled_sensors.hosted import Blind, weather_told
from evaluation.modelled_sensors.sign_faces import CLASSES
from evaluation.run.host import drive
from proto.truth import TrueActor
from proto.vehicle import Ego
from services.perception.pipeline import Perception
from studies.modelled_sensors.imagined import imagine
from studies.modelled_sensors.recording import Recording, listener, load, save
from tests.unit.studies.modelled_sensors.support import NS, SPEC, car, drawn, truth
from training.detector.probabilities import calibrated


def sign(x_m: float) -> dict[str, str | float]:
    return {"id": 1001.0, "code": "limit:80", "country": "DEU", "x_m": x_m, "y_m": -4.0}


@pytest.mark.parametrize("kind", ["vehicle", "pedestrian"])
def test_road_users_are_told_from_the_score_on_that_the_detectors_card_has(kind: str) -> None:
    shipped = json.loads(data("models/detector.json").read_text(encoding="utf-8"))
    told = calibrated(np.array([shipped["floors"][kind]]), shipped["calibration"][kind])[0]
    assert SCORE_FLOORS.get(kind, SCORE_FLOOR) == pytest.approx(told, abs=0.005)


def test_what_is_drawn_depends_on_seed_and_thing_alone(card: Card) -> None:
    def seen(seed: int, *others: TrueActor) -> list[tuple[float, ...]]:
        eye, told = Eye(card, "front", seed), list[tuple[float, ...]]()
        for k in range(60):
            found = eye.look(truth(k / 10, car(1, 60.0, 1.0), *others), NS + k * NS // 10)
            told += [
                (k, each.detection.x0_px, each.detection.score) for each in found if 300 < each.detection.x0_px < 320
            ]
        return told

    assert seen(1) == seen(1)
    assert seen(1) != seen(2)
    assert seen(1) == seen(1, car(2, 30.0, 9.0)), "another car beside changes nothing"


def test_near_cars_are_found_more_often_than_far_ones(card: Card) -> None:
    def share(x_m: float) -> float:
        found = 0
        for seed in range(12):
            eye = Eye(card, "front", seed)
            for k in range(20):
                boxes = eye.look(truth(k / 10, car(1, x_m)), NS + k * NS // 10)
                found += any(each.detection.kind == "vehicle" for each in boxes)
        return found / 240

    assert share(25.0) > 0.9 > share(110.0)


def test_an_approached_sign_is_believed_rightly_before_it_is_passed(card: Card) -> None:
    believed = 0
    for seed in range(10):
        steps = [(NS + k * NS // 10, truth(k / 10, signs=(sign(90.0 - 2.0 * k),))) for k in range(44)]
        told = imagine(drawn(steps), card, seed)
        readings = [
            fact.reading for _, facts in told.facts for fact in facts.facts if fact.believed and fact.kind == "limit"
        ]
        believed += "limit:80" in readings
    assert believed >= 8


def test_faces_are_told_apart_by_country() -> None:
    assert CLASSES.label("DEU town_entry") == "town_entry:yellow"
    assert CLASSES.label("USA limit:25") == "limit_board:25"
    assert CLASSES.label(" light:red") == "light:red"
    assert CLASSES.label("DEU nonsense") == "other"


def test_weather_that_no_run_had_is_not_told(card: Card) -> None:
    assert weather_told(card.weather, msgspec.structs.replace(truth(1.0), visibility_m=None), 1) is None
    assert weather_told((), truth(1.0), 1) is None


def test_a_class_whose_range_lidar_never_measured_gets_none_by_lidar(card: Card) -> None:
    eye = Eye(by_lidar(card, 9.0, errors={}), "front", 1)
    found = [each for k in range(20) for each in eye.look(truth(k / 10, car(1, 25.0)), NS + k * NS // 10)]
    assert found
    assert all(each.range is None or each.range.source != "lidar" or each.range.returns == 3 for each in found)


def test_a_file_that_is_no_model_is_named(tmp_path: Path) -> None:
    path = tmp_path / "observed.json"
    path.write_text("{}")
    with pytest.raises(UserError, match=r"observed\.json"):
        read_card(path)


def test_a_modelled_run_publishes_what_production_would_and_comes_out_alike(tmp_path: Path) -> None:
    runs = []
    for name in ("a", "b"):
        told = Recording(spec=SPEC)
        assert drive(SPEC, tmp_path / name, listener(told)).finished
        save(told, tmp_path / f"{name}.rec")
        runs.append(load(tmp_path / f"{name}.rec"))
    first, second = runs
    assert len(first.tracks) == 25, "ten a second"
    assert {boxes.camera for _, boxes in first.boxes} == {"front", "tele"}
    assert len(first.advisories) >= 24, "a tick begins with every snapshot"
    assert msgspec.json.encode(first.advisories) == msgspec.json.encode(second.advisories)
    assert [(at, each.facts) for at, each in first.facts] == [(at, each.facts) for at, each in second.facts]
    assert msgspec.json.encode(first.tracks) == msgspec.json.encode(second.tracks)


def test_the_model_is_what_it_says(card: Card) -> None:
    assert {"front/vehicle", "tele/sign"} <= set(card.found)
    assert all(isinstance(each.seen.odds, Line) and each.pictures > 40 for each in card.found.values())
    assert card.provenance["runs"]


def test_the_first_measured_range_comes_with_the_sweep_before_which_tells_the_speed(card: Card) -> None:
    errors = sorted(abs(speed_error(card, seed)) for seed in range(15))
    assert errors[7] < 2.0, "14 without the sweep before"


def speed_error(card: Card, seed: int) -> float:
    """Of an oncoming car that was followed by guessed ranges for a second, in the first picture with a measured one."""
    pipeline = Perception(Blind())
    guessing, measuring = (Eye(by_lidar(card, odds), "front", seed) for odds in (-30.0, 30.0))
    pipeline.calibrate("front", guessing.calibration)
    for k in range(20):
        at, x_m = NS + k * NS // 10, 90.0 - 5.0 * k
        then = truth(k / 10, msgspec.structs.replace(car(1, x_m, 3.0), vx_mps=-50.0))
        pipeline.ego(at, Ego(speed_mps=then.speed_mps, yaw_rate_radps=0.0))
        seen = (measuring if k >= 10 else guessing).understood(pipeline, then, at, k)
        if seen.tracks is not None and seen.tracks.tracks and any(b.range_source == "lidar" for b in seen.boxes.boxes):
            return min(seen.tracks.tracks, key=lambda each: abs(each.x_m - x_m)).vx_mps + 50.0
    raise AssertionError("no picture showed it")


def by_lidar(card: Card, odds: float, **fields: object) -> Card:
    """The model with ranges that are all measured, or all guessed; `fields` of them changed."""
    weights = (odds,) + 8 * (0.0,)
    ranged = {
        name: msgspec.structs.replace(each, lidar=msgspec.structs.replace(each.lidar, weights=weights), **fields)
        for name, each in card.ranged.items()
    }
    return msgspec.structs.replace(card, ranged=ranged)
