"""Our detector on a rendered picture, and models that cannot be used."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from drivemcp.paths import data
from services.perception.detect.detector import DetectorError, DetectorOptions, Picture
from services.perception.detect.loading import load_detector


def test_our_detector_finds_car_and_sign_where_they_are(street: Picture) -> None:
    found = load_detector(data("models/detector.onnx")).detect(street)
    car = next(each for each in found if each.kind == "vehicle")
    assert 250 < car.centre_px[0] < 390
    assert car.score > 0.3
    signs = [each for each in found if each.kind == "sign"]
    assert any(each.centre_px[0] > 400 and each.centre_px[1] < 180 for each in signs)


def test_a_picture_of_another_size_gives_boxes_in_its_own_pixels(street: Picture) -> None:
    large = np.ascontiguousarray(np.repeat(np.repeat(street, 2, axis=0), 2, axis=1))
    detector = load_detector(data("models/detector.onnx"))
    small_car = next(each for each in detector.detect(street) if each.kind == "vehicle")
    large_car = next(each for each in detector.detect(large) if each.kind == "vehicle")
    assert np.array(large_car.centre_px) == pytest.approx(2 * np.array(small_car.centre_px), abs=6)


def test_nothing_is_found_in_an_empty_picture() -> None:
    assert load_detector(data("models/detector.onnx")).detect(np.full((360, 640, 3), 110, np.uint8)) == []


def test_the_card_matches_the_model_and_tells_what_was_measured() -> None:
    path = data("models/detector.onnx")
    card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert path.stat().st_size < 4_000_000
    assert set(card["ap50_test"]) == set(card["classes"])
    assert card["ap50_test"]["vehicle"] > 0.6


def test_an_absent_model_is_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(DetectorError, match=r"no detector model at .*none\.onnx"):
        load_detector(tmp_path / "none.onnx")


def test_a_file_that_is_no_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "broken.onnx"
    path.write_bytes(b"no model at all")
    with pytest.raises(DetectorError, match="no model that ONNX Runtime can load"):
        load_detector(path)


def test_a_model_of_another_kind_is_refused() -> None:
    with pytest.raises(DetectorError, match="no detector that we know"):
        load_detector(data("models/reader.onnx"))


def test_an_unknown_class_in_the_card_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "detector.onnx"
    path.write_bytes(data("models/detector.onnx").read_bytes())
    path.with_suffix(".json").write_text('{"classes": ["vehicle", "unicorn"]}', encoding="utf-8")
    with pytest.raises(DetectorError, match="unknown classes"):
        load_detector(path)


def test_a_floor_in_the_options_silences_a_class(street: Picture) -> None:
    keen = load_detector(data("models/detector.onnx"))
    assert any(each.kind == "vehicle" for each in keen.detect(street))
    deaf = load_detector(data("models/detector.onnx"), DetectorOptions(floors={"vehicle": 1.1}))
    assert not any(each.kind == "vehicle" for each in deaf.detect(street))
