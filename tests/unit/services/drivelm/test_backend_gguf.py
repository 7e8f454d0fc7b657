"""A language model of a GGUF file completes whole prompts: within its bounds, by its own probabilities, the same each time."""

import hashlib
import logging
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.errors import ConfigError
from services.drivelm.backends.config import GgufConfig, OpenaiConfig, TransformersConfig
from services.drivelm.backends.load import Completed, Slow, load, load_completing
from services.drivelm.service import DrivelmConfig
from tests.unit.services.drivelm import llama_stand_in, tiny_llama

FOLLOWS = {"a": "b", "b": "c", "c": "."}
ENDLESS = {"a": "b", "b": "a"}
COMPLETED = Completed("head ", 'root ::= "ac" "\\n"\n', hashlib.sha256(b"template").hexdigest())


@pytest.fixture(params=["stand-in", "llama_cpp"])
def model(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[dict[str, str]], Path]:
    """Writes a model that goes on by a table; by the real library where it is installed."""
    if request.param == "stand-in":
        monkeypatch.setitem(sys.modules, "llama_cpp", llama_stand_in.module())
        write: Callable[[Path, dict[str, str]], None] = llama_stand_in.write
    else:
        pytest.importorskip("llama_cpp", reason="the extra language-model is not installed")
        pytest.importorskip("gguf", reason="the package gguf, which writes the tiny model, is not installed")
        write = tiny_llama.make

    def make(follows: dict[str, str]) -> Path:
        write(file := tmp_path / "tiny.gguf", follows)
        return file

    return make


def test_it_completes_a_prompt_up_to_the_end_of_the_line_with_the_probability_of_its_tokens(
    model: Callable[[dict[str, str]], Path],
) -> None:
    backend = load_completing(GgufConfig(file=str(model(FOLLOWS)), context=256), COMPLETED)
    text, score = backend.free(None, "head a")
    assert text == "bc."
    assert 0.9 < score <= 1.0
    assert backend.free(None, "another head a")[0] == "bc."
    assert backend.name.startswith("gguf:free:tiny:")
    assert backend.name.endswith(COMPLETED.sha256[:12])


def test_an_answer_depends_on_its_prompt_alone(model: Callable[[dict[str, str]], Path]) -> None:
    backend = load_completing(GgufConfig(file=str(model(FOLLOWS)), context=256), COMPLETED)
    prompts = ["head a", "head xyz b", "no head a", "head a"]
    forth = {prompt: backend.free(None, prompt) for prompt in prompts}
    assert {prompt: backend.free(None, prompt) for prompt in reversed(prompts)} == forth


def test_a_grammar_holds_the_words_and_the_score_stays_the_models_own(model: Callable[[dict[str, str]], Path]) -> None:
    config = GgufConfig(file=str(model(FOLLOWS)), context=256, decoding="forms")
    text, score = load_completing(config, COMPLETED).free(None, "head a")
    assert text == "ac"
    assert score < 0.1


@pytest.mark.parametrize(
    ("bound", "reason"),
    [({"max_tokens": 5}, "cut off"), ({"timeout_s": 1e-9}, "no answer in time"), ({"context": 256}, "prompt too long")],
)
def test_what_does_not_end_within_its_bounds_is_an_abstention(
    model: Callable[[dict[str, str]], Path], bound: dict[str, float], reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    backend = load_completing(msgspec.convert({"file": str(model(ENDLESS)), **bound}, GgufConfig), COMPLETED)
    prompt = "head a" if "context" not in bound else f"head {'a' * 300}"
    with caplog.at_level(logging.WARNING, "drivemcp.drivelm"):
        assert backend.free(None, prompt) == ("", 0.0)
    assert reason in caplog.text


def test_after_an_answer_that_came_too_late_the_next_is_as_ever(
    model: Callable[[dict[str, str]], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    backend = load_completing(GgufConfig(file=str(model(FOLLOWS)), context=256), COMPLETED)
    expected = backend.free(None, "head a")
    monkeypatch.setattr(backend, "_config", msgspec.structs.replace(backend._config, timeout_s=-1.0))
    assert backend.free(None, "head b") == ("", 0.0)
    monkeypatch.setattr(backend, "_config", msgspec.structs.replace(backend._config, timeout_s=10.0))
    assert backend.free(None, "head a") == expected


def test_what_cannot_be_used_is_told_in_one_line_with_its_field(
    model: Callable[[dict[str, str]], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, foreign = model(FOLLOWS), tmp_path / "foreign.gguf"
    foreign.write_text("no model", encoding="utf-8")
    monkeypatch.setenv("DRIVEMCP_MODELS", str(tmp_path / "none"))
    told = {
        "drivelm.gguf.file: no such file": GgufConfig(file=str(tmp_path / "absent.gguf")),
        "drivelm.gguf.sha256": GgufConfig(file=str(file), sha256="0" * 64),
        "drivelm.gguf.file.*cannot be loaded": GgufConfig(file=str(foreign)),
        "Gemma Terms of Use.*models pull gemma3-270m --accept-terms": GgufConfig(),
    }
    for words, config in told.items():
        with pytest.raises(ConfigError, match=words) as error:
            load_completing(config, COMPLETED)
        assert "\n" not in str(error.value)
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert digest[:12] in load_completing(GgufConfig(file=str(file), sha256=digest, context=256), COMPLETED).name


def test_it_looks_at_no_pictures_and_is_refused_as_the_backend_that_does() -> None:
    with pytest.raises(ConfigError, match=r"drivelm\.prompt_backend"):
        load("gguf", Slow(transformers=TransformersConfig(), openai=OpenaiConfig()))


@pytest.mark.skipif(find_spec("llama_cpp") is not None, reason="the extra language-model is installed")
def test_without_its_extra_the_extra_is_named() -> None:
    with pytest.raises(ConfigError, match=r"drivemcp\[language-model\]"):
        load_completing(GgufConfig(), COMPLETED)


def test_its_settings_are_checked_by_the_service() -> None:
    with pytest.raises(msgspec.ValidationError, match="decoding"):
        msgspec.convert({"gguf": {"decoding": "greedy"}}, DrivelmConfig)
    with pytest.raises(msgspec.ValidationError, match="sha256"):
        msgspec.convert({"gguf": {"sha256": "abc"}}, DrivelmConfig)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(prompt=st.text(max_size=80))
def test_any_prompt_is_answered_or_abstained_from(model: Callable[[dict[str, str]], Path], prompt: str) -> None:
    backend = load_completing(GgufConfig(file=str(model(FOLLOWS)), context=512, max_tokens=8), COMPLETED)
    text, score = backend.free(None, prompt)
    assert 0.0 <= score <= 1.0
    assert "\n" not in text
