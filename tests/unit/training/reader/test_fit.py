"""Fitting and exporting the reader, on a handful of crops; skipped where torch is not installed."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("onnxscript")


def test_a_fitted_network_survives_export_with_its_temperature(tmp_path: Path) -> None:
    import warnings

    import onnxruntime
    import torch

    from services.drivelm.vocabulary.classes import READER_CLASSES
    from training.reader import fit

    chance = np.random.default_rng(0)
    crops, labels = chance.integers(0, 255, (64, 48, 48, 3)).astype(np.uint8), np.arange(64) % 5
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # torch's exporter warns of its own future
        network = fit.fit([fit.Part(crops, labels, 1.0)], 3, 16, seed=1)
        fit.export(network, 1.7, tmp_path / "reader.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "reader.onnx"), providers=["CPUExecutionProvider"])
    batch = np.ascontiguousarray(crops[:5].transpose(0, 3, 1, 2), dtype=np.float32)
    got = session.run(None, {"crops": batch})[0]
    with torch.no_grad():
        expected = torch.softmax(network(torch.from_numpy(batch)) / 1.7, dim=1).numpy()
    assert got.shape == (5, len(READER_CLASSES))
    assert np.allclose(got, expected, atol=1e-4)
    with torch.no_grad():
        resumed = fit.resumed(tmp_path / "reader.onnx", crops)(torch.from_numpy(batch))
    assert np.allclose(torch.softmax(resumed / 1.7, dim=1).numpy(), got, atol=1e-4)


@pytest.mark.parametrize(
    ("true", "read", "costly"),
    [
        ("light:red", "light:green", True), ("light:red_left", "light:green_left", True), ("light:green", "light:red", False),
        ("limit:30", "limit:80", True), ("limit:80", "limit:30", False), ("limit:30", "limit_board:80", False),
        ("limit:30", "other", False), ("led:100", "led:120", True), ("limit:50", "limit:50", False),
    ],
)  # fmt: skip
def test_dangerous_mistakes_cost_more_than_others(true: str, read: str, costly: bool) -> None:
    import torch

    from services.drivelm.vocabulary.classes import READER_CLASSES
    from training.reader.fit import loss_of

    label = torch.tensor([READER_CLASSES.index(true)])
    scores = torch.zeros(1, len(READER_CLASSES))
    scores[0, READER_CLASSES.index(read)] = 6.0
    plain = torch.nn.functional.cross_entropy(scores, label)
    some = 0.1  # every class keeps a little probability, dangerous ones too
    assert (float(loss_of(scores, label) - plain) > some) == costly


def test_the_learning_rate_rises_and_falls_to_nothing() -> None:
    from training.reader.fit import RISING, rate_share

    shares = [rate_share(past) for past in np.linspace(0, 1, 101)]
    assert max(shares) == pytest.approx(1.0)
    assert int(np.argmax(shares)) == round(100 * RISING)
    assert shares[-1] == pytest.approx(0.0)


def test_training_ends_with_the_clock() -> None:
    from training.reader import fit

    crops, labels = np.zeros((8, 48, 48, 3), np.uint8), np.zeros(8, np.int64)
    network = fit.fit([fit.Part(crops, labels, 1.0)], 1_000_000, 8, seed=1, minutes=0.02)
    assert not network.training


def test_a_batch_has_of_each_part_its_share(tmp_path: Path) -> None:
    from training.reader.fit import Part, _batch

    parts = [
        Part(np.full((5, 48, 48, 3), n, np.uint8), np.full(5, n), share)
        for n, share in ((1, 0.5), (2, 0.15), (3, 0.35))
    ]
    labels = _batch(parts, 64, np.random.default_rng(1))[1]
    assert np.bincount(labels).tolist() == [0, 32, 10, 22]


def test_scores_are_rescaled_until_the_probabilities_are_honest(tmp_path: Path) -> None:
    """In the file itself, so that they tell more of the crops than before."""
    import json
    import warnings

    from services.drivelm.reading.reader import Reader
    from services.drivelm.vocabulary.classes import READER_CLASSES
    from training.reader import fit
    from training.reader.train import rescale

    chance = np.random.default_rng(0)
    crops, labels = chance.integers(0, 255, (64, 48, 48, 3)).astype(np.uint8), np.arange(64) % 5
    path = tmp_path / "reader.onnx"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # torch's exporter warns of its own future
        fit.export(fit.fit([fit.Part(crops, labels, 1.0)], 3, 16, seed=1), 0.05, path)
    path.with_suffix(".json").write_text(json.dumps({"classes": list(READER_CLASSES)}), encoding="utf-8")

    def surprise() -> float:
        told = Reader.load(path).probabilities(crops)
        return float(-np.log(told[np.arange(len(labels)), labels]).mean())

    before = surprise()
    assert rescale(path, crops, labels) != pytest.approx(1.0)
    assert surprise() < before
