"""The shipped reader: its card is true, it reads clean signs in every lettering of ours, and it knows what is no sign."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from drivemcp.paths import data
from services.drivelm.backends.backend import EmbeddedBackend
from services.drivelm.reading.crops import Region, crop
from services.drivelm.reading.reader import Reader, UnusableModel
from services.drivelm.vocabulary.classes import BY_KIND, QUESTIONS, READER_CLASSES, SENTENCES
from services.simulator.signart import draw_face

MODEL = data("models/reader.onnx")
LIMITS = [f"limit:{value}" for value in range(10, 140, 10)]


@pytest.fixture(scope="module")
def reader() -> Reader:
    return Reader.load(MODEL)


def _shown(country: str, code: str, font: int = 0, size_px: int = 40) -> np.ndarray:
    """A face before grey, cut out as a box would be."""
    face = draw_face(country, code, font=font, size_px=size_px)
    height, width = face.shape[:2]
    picture = np.full((height + 40, width + 40, 3), 135, np.uint8)
    share = face[..., 3:] / 255
    picture[20 : 20 + height, 20 : 20 + width] = (face[..., :3] * share + 135 * (1 - share)).astype(np.uint8)
    cut = crop(picture, Region(20, 20, 20 + width, 20 + height))
    assert cut is not None
    return cut


def test_the_card_names_the_file_it_describes_and_the_classes_in_use() -> None:
    card = json.loads(MODEL.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(MODEL.read_bytes()).hexdigest()
    assert card["classes"] == list(READER_CLASSES)
    assert MODEL.stat().st_size < 4_000_000
    assert {"seed", "recipe", "scores", "temperature"} <= card.keys()


def test_clean_limits_are_read_in_every_stroke_lettering(reader: Reader) -> None:
    wanted = [(code, font) for code in LIMITS for font in range(12)]
    readings = reader.read(np.stack([_shown("DEU", *one) for one in wanted]), ("sign",) * len(wanted))
    wrong = [(one, got.label) for one, got in zip(wanted, readings, strict=True) if got.label != one[0]]
    assert len(wrong) <= 0.02 * len(wanted), wrong


@pytest.mark.parametrize(
    ("country", "code", "kind", "label"),
    [
        ("DEU", "stop", "sign", "stop"),
        ("GBR", "yield", "sign", "yield"),
        ("GBR", "national", "sign", "national"),
        ("DEU", "all_end", "sign", "all_end"),
        ("DEU", "priority_road", "sign", "priority_road"),
        ("DEU", "zone:30", "sign", "zone:30"),
        ("DEU", "motorway", "sign", "motorway"),
        ("GBR", "keep_left", "sign", "keep_left"),
        ("GBR", "border:GBR", "sign", "border:GBR"),
        ("DEU", "no_vehicles", "sign", "no_vehicles"),
        ("DEU", "plate:when_wet:de", "plate", "plate:when_wet:de"),
        ("GBR", "plate:when_wet:en", "plate", "plate:when_wet:en"),
        ("DEU", "plate:arrow_left", "plate", "plate:arrow_left"),
        ("POL", "plate:when_wet:pl", "plate", "plate:when_wet:pl"),
        ("USA", "limit:45", "sign", "limit_board:45"),
        ("USA", "stop", "sign", "stop"),
        ("CHE", "motorway", "sign", "motorway"),
        ("DEU", "led:80", "panel", "led:80"),
        ("DEU", "led:lane_closed", "panel", "led:lane_closed"),
    ],
)
def test_clean_signs_are_read(reader: Reader, country: str, code: str, kind: str, label: str) -> None:
    assert reader.read(_shown(country, code)[None], (kind,))[0].label == label


def test_what_cannot_be_of_a_kind_is_no_evidence_for_what_can(reader: Reader) -> None:
    reading = reader.read(_shown("DEU", "limit:80")[None], ("light",))[0]
    assert reading.label == "other"
    assert reading.probability > 0.9


def test_flat_grey_and_noise_are_no_signs(reader: Reader) -> None:
    chance = np.random.default_rng(3)
    grey = np.stack([np.full((48, 48, 3), level, np.uint8) for level in (40, 120, 220)])
    noise = chance.integers(0, 255, (5, 48, 48, 3)).astype(np.uint8)
    readings = reader.read(np.concatenate([grey, noise]), ("sign",) * 8)
    assert not [reading for reading in readings if reading.label != "other" and reading.probability > 0.9]


def test_probabilities_sum_to_one_and_rank_within_the_kind(reader: Reader) -> None:
    assert reader.probabilities(_shown("DEU", "stop")[None]).sum() == pytest.approx(1, abs=1e-4)
    reading = reader.read(_shown("DEU", "stop")[None], ("sign",), keep=3)[0]
    assert len(reading.ranked) == 3
    assert all(label in BY_KIND["sign"] for label, _ in reading.ranked)


def test_the_embedded_backend_answers_in_sentences_and_leaves_free_questions_alone(reader: Reader) -> None:
    backend = EmbeddedBackend(reader, "0123456789abcdef")
    answer = backend.answer([_shown("DEU", "limit:80")], QUESTIONS["sign"])[0]
    assert answer.text == SENTENCES["limit:80"]
    assert answer.score > 0.9
    assert backend.answer([_shown("DEU", "limit:80")], "What colour is the car?")[0].score == 0
    assert backend.answer([], QUESTIONS["sign"]) == []
    assert backend.name == "embedded:0123456789ab"


def test_a_card_with_unknown_classes_is_refused(tmp_path: Path) -> None:
    (tmp_path / "reader.onnx").write_bytes(MODEL.read_bytes())
    (tmp_path / "reader.json").write_text(json.dumps({"classes": ["other", "warp:9"]}), encoding="utf-8")
    with pytest.raises(UnusableModel, match="warp:9"):
        Reader.load(tmp_path / "reader.onnx")
