"""A local checkpoint is asked with its own processor and template; its sentences and probabilities are its own."""

import json
import logging
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra drivelm-transformers is not installed")
pytest.importorskip("transformers", reason="the extra drivelm-transformers is not installed")

from drivemcp.errors import ConfigError
from services.drivelm.backends.backend import NO_ANSWER
from services.drivelm.backends.config import TransformersConfig
from services.drivelm.backends.prompts import load
from services.drivelm.backends.transformers import TransformersBackend
from services.drivelm.vocabulary.classes import QUESTIONS, SENTENCES
from tests.unit.services.drivelm.tiny_vlm import BLUE, RED, make

SIGN = QUESTIONS["sign"]


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("taught")
    make(folder, taught=True)
    return folder


def _backend(folder: Path, **options: object) -> TransformersBackend:
    return TransformersBackend(TransformersConfig(folder=str(folder), **options), load())  # type: ignore[arg-type]


def test_it_says_of_each_picture_what_the_model_says_with_its_probability(taught: Path) -> None:
    red, blue = _backend(taught).answer([RED, BLUE], SIGN)
    assert (red.text, blue.text) == (SENTENCES["stop"], SENTENCES["roundabout"])
    assert 0.5 < red.score <= 1.0
    assert red.measured


def test_the_score_falls_where_the_picture_tells_less(taught: Path) -> None:
    mixed = [(RED * (1 - share) + BLUE * share).astype(np.uint8) for share in (0.3, 0.4, 0.5, 0.6, 0.7)]
    sure, *between = _backend(taught).answer([RED, *mixed], SIGN)
    assert min(answer.score for answer in between) < sure.score


def test_a_model_that_knows_nothing_abstains(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    make(tmp_path, taught=False)
    with caplog.at_level(logging.WARNING, "drivemcp.drivelm"):
        answers = _backend(tmp_path, max_tokens=8).answer([RED, BLUE], SIGN)
    assert answers == [NO_ANSWER, NO_ANSWER]
    assert "abstains" in caplog.text


@pytest.mark.parametrize("bound", [{"max_tokens": 3}, {"timeout_s": 1e-9}])
def test_what_does_not_end_within_its_bounds_is_an_abstention(
    taught: Path, bound: dict[str, float], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, "drivemcp.drivelm"):
        assert _backend(taught, **bound).answer([RED], SIGN) == [NO_ANSWER]
    assert "cut off" in caplog.text


def test_other_questions_are_not_answered(taught: Path) -> None:
    backend = _backend(taught)
    assert backend.answer([RED], "Who are you?") == [NO_ANSWER]
    assert backend.answer([], SIGN) == []


def test_its_name_changes_with_its_weights(taught: Path, tmp_path: Path) -> None:
    make(tmp_path, taught=False)
    assert _backend(taught).name.startswith(f"transformers:{taught.name}:")
    assert _backend(taught).name.split(":")[2] != _backend(tmp_path).name.split(":")[2]
    assert _backend(taught).name.endswith(f" prompts:{load().sha256[:12]}")
    assert _backend(taught).prompts == load().sha256


def test_a_folder_that_cannot_be_used_is_refused_in_one_line(taught: Path, tmp_path: Path) -> None:
    def refused(config: TransformersConfig) -> str:
        with pytest.raises(ConfigError) as caught:
            TransformersBackend(config, load())
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert refused(TransformersConfig()).startswith("drivelm.transformers.folder is missing")
    assert "no checkpoint in '/no/such'" in refused(TransformersConfig(folder="/no/such"))
    assert "cannot be loaded" in refused(TransformersConfig(folder=str(taught), device="warp-drive"))
    (tmp_path / "config.json").write_text(json.dumps({"model_type": "no-such-family"}))
    assert "cannot be loaded" in refused(TransformersConfig(folder=str(tmp_path)))


def test_weights_as_pickles_are_never_loaded(taught: Path, tmp_path: Path) -> None:
    for file in taught.iterdir():
        if file.suffix != ".safetensors":
            (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "pytorch_model.bin").write_bytes(b"\x80\x04.")
    with pytest.raises(ConfigError, match="cannot be loaded"):
        _backend(tmp_path)


def test_a_checkpoint_without_a_chat_template_is_refused(taught: Path, tmp_path: Path) -> None:
    for file in taught.iterdir():
        if file.suffix != ".jinja":
            (tmp_path / file.name).write_bytes(file.read_bytes())
    with pytest.raises(ConfigError, match="no chat template"):
        _backend(tmp_path)


@pytest.mark.skipif(find_spec("torchvision") is not None, reason="torchvision is installed")
def test_a_family_that_insists_on_torchvision_is_refused_with_that_reason(taught: Path, tmp_path: Path) -> None:
    for file in taught.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    processor = json.loads((tmp_path / "processor_config.json").read_text())
    (tmp_path / "processor_config.json").write_text(json.dumps(processor | {"processor_class": "Qwen2VLProcessor"}))
    with pytest.raises(ConfigError, match=r"(?i)cannot be loaded: .*torchvision"):
        _backend(tmp_path)
