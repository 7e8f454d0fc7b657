"""Trains the sign reader on drawn signs and writes ``models/reader.onnx`` and ``models/reader.json``.

``python -m training reader.train --out models`` (extras ``simulator`` and ``train``). Crops are made first
(no torch needed: ``--only-crops``), then learned for a fixed number of steps, so that a seed gives the same network on
the same computer and library versions. The score table is measured with letterings and backgrounds that training never
saw, on the exported file, through ONNX Runtime.
"""

import argparse
import hashlib
import json
import logging
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import READER_CLASSES
from training.photographs.sets import SETS, RealSet, carded
from training.reader.real.scores import real_table
from training.reader.samples import Source
from training.reader.scores import Measured, Sure, score_table, sure_from
from training.reader.tracks import track_table
from training.sign_pictures.fonts import letterings

_log = logging.getLogger("reader")
Crops = tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float32]]
"""Crops, class indexes, sizes in pixels."""
CropsAndLabels = tuple[NDArray[np.uint8], NDArray[np.int64]]
FONT_FOLDERS = (Path("/usr/share/fonts"),)
SCORED_SEED = 1
"""Scores are of the same crops whatever the seed of training."""
EACH = 240
"""Faces of a class in training: as many as there are letterings, so that a class is met in most of them."""


def main(arguments: list[str] | None = None) -> int:
    """Make crops, train, calibrate, export, score."""
    options = _options(arguments)
    options.command = shlex.join(["python", "-m", "training.reader.train", *(arguments or sys.argv[1:])])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    cv2.setNumThreads(1)
    if options.only_scores:
        _add_scores(options)
        return 0
    if options.mean_of:
        _mean(options)
        return 0
    crops, labels = _training_crops(options)
    if options.only_crops:
        return 0
    from training.reader import fit

    started = time.monotonic()
    rendered = _joined(options.rendered)
    rate = options.rate or (3e-3 if options.start is None else 1.5e-3)
    before = None if options.start is None else hashlib.sha256(options.start.read_bytes()).hexdigest()
    real = _joined(options.real)
    shares = _shares(rendered is not None, real is not None)
    parts = [
        fit.Part(*each, share)
        for each, share in zip(((crops, labels), rendered, real), shares, strict=True)
        if each is not None
    ]
    network = fit.fit(
        parts, options.steps, options.batch, options.seed, rate, options.start, options.threads, options.minutes
    )
    _log.info("trained in %.0f s", time.monotonic() - started)
    fresh = Source("train", options.seed + 7, options.fonts, each=12)
    held = fresh.batch(options.calibration, np.random.default_rng([options.seed, 3]))[:2]
    temperature = fit.temperature(network, *_evened(held, _joined(options.real_held_out)))
    options.out.mkdir(parents=True, exist_ok=True)
    fit.export(network, temperature, options.out / "reader.onnx")
    recipe = {
        "command": options.command,
        "started_from": before,
        "letterings": sorted(fresh.letters),
        "rendered_crops": 0 if rendered is None else len(rendered[0]),
        "real_crops": 0 if real is None else len(real[0]),
        "photographs": carded(_sets(options.real)),
        "training_s": round(time.monotonic() - started),
    }
    _write_card(options, temperature, recipe)
    return 0


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("models"))
    parser.add_argument("--cache", type=Path, default=Path("out/reader"), help="where the crops are kept")
    parser.add_argument("--fonts", type=Path, nargs="*", default=FONT_FOLDERS)
    parser.add_argument("--crops", type=int, default=100_000)
    parser.add_argument(
        "--lights", type=int, default=0, help="so many crops of traffic lights more; --crops in thousands then"
    )
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--batch", type=int, default=96)
    parser.add_argument("--calibration", type=int, default=6000)
    parser.add_argument("--tests", type=int, default=8000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=Path, help="an exported reader to train further; else from nothing")
    parser.add_argument(
        "--rendered", type=Path, nargs="*", default=(), help="crops of rendered pictures to train on too"
    )
    parser.add_argument(
        "--real",
        type=Path,
        nargs="*",
        default=(),
        help="crops of photographs to train on too (training reader.real.crops)",
    )
    parser.add_argument("--real-held-out", type=Path, nargs="*", default=(), help="such crops that training leaves out")
    parser.add_argument("--real-folder", type=Path, help="the photographs themselves, to score the tracks left out")
    parser.add_argument("--minutes", type=float, help="train for so long, at most --steps")
    parser.add_argument("--rate", type=float, help="the highest learning rate")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rendered-test", type=Path, help="such crops of the split test (reader_rendered), to score")
    parser.add_argument("--lights-test", type=Path, help="such crops of lights alone (reader_rendered --lights)")
    parser.add_argument(
        "--mean-of", type=Path, nargs=2, help="two readers, AFTER trained on from BEFORE: write their mean"
    )
    parser.add_argument("--mean-share", type=float, default=0.5, help="how much of the mean is AFTER's")
    parser.add_argument("--only-crops", action="store_true")
    parser.add_argument("--only-scores", action="store_true", help="measure the reader in --out again")
    options = parser.parse_args(arguments)
    options.fonts = tuple(options.fonts)
    return options


REAL_SHARE, RENDERED_SHARE, RENDERED_BESIDE_REAL = 0.5, 0.3, 0.15
"""Shares of each batch: of photographs, of rendered pictures without photographs and with them; the rest is drawn."""


def _shares(rendered: bool, real: bool) -> tuple[float, float, float]:
    """Shares of drawn, rendered and photographed crops, by which there are."""
    of_real = REAL_SHARE if real else 0.0
    of_rendered = (RENDERED_BESIDE_REAL if real else RENDERED_SHARE) if rendered else 0.0
    return 1.0 - of_real - of_rendered, of_rendered, of_real


def crops_of(path: Path | None) -> Crops | None:
    """The file that `reader_rendered` wrote, if one is named."""
    if path is None:
        return None
    with np.load(path) as stored:
        return stored["crops"], stored["labels"], stored["sizes"]


def _joined(paths: Sequence[Path]) -> CropsAndLabels | None:
    """Crops and classes of several such files."""
    found = [stored for path in paths if (stored := crops_of(path)) is not None]
    return (np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])) if found else None


def _training_crops(options: argparse.Namespace) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Crops from the cache, or drawn now: half of them in easy conditions, half in the full mixture; the last
    ``options.lights`` of traffic lights alone."""
    folder: Path = options.cache
    crops_file, labels_file = folder / f"crops-{options.seed}.npy", folder / f"labels-{options.seed}.npy"
    if labels_file.is_file():
        return np.load(crops_file, mmap_mode="r"), np.load(labels_file)
    folder.mkdir(parents=True, exist_ok=True)
    source = Source("train", options.seed, options.fonts, each=EACH)
    chance = np.random.default_rng([options.seed, 2])
    total = options.crops + options.lights
    shape = (total, 48, 48, 3)
    crops = np.lib.format.open_memmap(crops_file, mode="w+", dtype=np.uint8, shape=shape)
    labels = np.zeros(total, np.int64)
    for start in range(0, total, 1000):
        count = min(1000, total - start)
        part, hard = slice(start, start + count), (start // 1000) % 2 * 0.6 + 0.4
        crops[part], labels[part], _ = source.batch(count, chance, hard, lights=start >= options.crops)
        if start % 10_000 == 0:
            _log.info("%d crops", start)
    crops.flush()
    np.save(labels_file, labels)
    return crops, labels


def _evened(drawn: CropsAndLabels, real: CropsAndLabels | None) -> CropsAndLabels:
    """As many photographs as drawn crops, so that one temperature makes both worlds' probabilities honest."""
    if real is None:
        return drawn
    count = min(len(drawn[0]), len(real[0]))
    crops = np.concatenate([drawn[0][:count], real[0][:count]])
    return crops, np.concatenate([drawn[1][:count], real[1][:count]])


def _sets(paths: Sequence[Path]) -> tuple[RealSet, ...]:
    """The sets of photographs whose crops these files hold."""
    names: set[str] = set()
    for path in paths:
        with np.load(path) as stored:
            names |= set(stored["sets"].tolist())
    return tuple(each for each in SETS if each.name in names)


def _mean(options: argparse.Namespace) -> None:
    """The mean of two trained readers' weights, the second trained on from the first, with their recipes in its card. Its
    temperature is fitted anew where there are photographs that training left out."""
    import onnx

    from training.detector.mean import mean

    cards = [json.loads(path.with_suffix(".json").read_text(encoding="utf-8")) for path in options.mean_of]
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "reader.onnx"
    before, after = (onnx.load(each) for each in options.mean_of)
    onnx.save(mean(before, after, options.mean_share), path)
    recipes = [card["recipe"] | {"seed": card["seed"], "sha256": card["sha256"]} for card in cards]
    letters = recipes[-1]["letterings"]
    for recipe in recipes:
        del recipe["letterings"]
    made = {
        "command": options.command,
        "mean_of": recipes,
        "share_of_the_later": options.mean_share,
        "letterings": letters,
    }
    if "photographs" in recipes[-1]:
        made["photographs"] = recipes[-1].pop("photographs")
    temperature = cards[0]["temperature"]  # the mean keeps the first one's
    if (real := _joined(options.real_held_out)) is not None:
        _write(made | {"classes": list(READER_CLASSES)}, options.out)
        fresh = Source("train", options.seed + 7, options.fonts, each=12)
        held = fresh.batch(options.calibration, np.random.default_rng([options.seed, 3]))[:2]
        temperature *= rescale(path, *_evened(held, real))
    _write_card(options, temperature, made)


def rescale(path: Path, crops: NDArray[np.uint8], labels: NDArray[np.int64]) -> float:
    """Scale the scores of an exported reader (its card beside it) so that its probabilities of these crops are honest; returns
    by what its temperature grew."""
    import onnx

    told = np.log(np.maximum(Reader.load(path).probabilities(crops), 1e-9))
    grid = np.exp(np.linspace(np.log(0.5), np.log(2.0), 81))
    grown = float(grid[int(np.argmin([_surprise(told / factor, labels) for factor in grid]))])
    model = onnx.load(path)
    for part in model.graph.initializer:
        if part.name in ("network.head.2.weight", "network.head.2.bias"):
            part.CopyFrom(onnx.numpy_helper.from_array(onnx.numpy_helper.to_array(part) / np.float32(grown), part.name))
    onnx.save(model, path)
    return grown


def _surprise(scores: NDArray[np.float32], labels: NDArray[np.int64]) -> float:
    """Mean cross entropy of scores (N x classes)."""
    total = np.log(np.exp(scores - scores.max(axis=1, keepdims=True)).sum(axis=1)) + scores.max(axis=1)
    return float((total - scores[np.arange(len(labels)), labels]).mean())


def _write_card(options: argparse.Namespace, temperature: float, recipe: dict[str, Any]) -> None:
    """The model's card: classes, recipe, scores on held-out letterings, digest."""
    path: Path = options.out / "reader.onnx"
    card: dict[str, Any] = {
        "classes": list(READER_CLASSES),
        "crop_px": 48,
        "input": "float32 N x 3 x 48 x 48, RGB, 0..255",
        "output": "probabilities N x classes, temperature included",
        "temperature": round(temperature, 4),
        "seed": options.seed,
        "recipe": recipe,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "size_bytes": path.stat().st_size,
        "licence": "Apache-2.0",
    }
    _write(card, options.out)
    _add_scores(options)


def _add_scores(options: argparse.Namespace) -> None:
    """Score the reader in the folder, into its card."""
    path: Path = options.out / "reader.onnx"
    card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    card |= scores(Reader.load(path), options)
    _write(card, options.out)
    _log.info("%s", json.dumps(card["scores"], indent=1))


def _write(card: dict[str, Any], folder: Path) -> None:
    (folder / "reader.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")


def scores(reader: Reader, options: argparse.Namespace) -> dict[str, Any]:
    """The card's tables: single crops of each kind, and whole approaches."""
    sure = tuned(reader, options.tests, options.fonts)
    source = Source("test", SCORED_SEED, options.fonts, each=10)
    more = crops_of(options.rendered_test), crops_of(options.lights_test)
    measured = held_out(reader, source, SCORED_SEED, options.tests, *more)
    measured |= lights_alone(reader, source, SCORED_SEED, options.tests * 3 // 8)
    photographs = real_table(reader, options.real_folder, sure)
    tables = {name: {"crops": len(each.labels), **score_table(each, sure)} for name, each in measured.items()}
    found: dict[str, Any] = {"scores": {"held_out_letterings": sorted(source.letters), **tables.pop("hard")}}
    found |= {"real": photographs} if photographs else {}
    found |= {f"scores_{name}": table for name, table in tables.items()}
    return found | {"tracks": track_table(reader, source, 300, SCORED_SEED)}


def tuned(reader: Reader, tests: int, fonts: tuple[Path, ...]) -> Sure | None:
    """From where a crop counts as sure; None where there is no lettering to choose that on (`TUNE_STEMS`)."""
    if not letterings("tune", fonts):
        return None
    tune = Source("tune", SCORED_SEED, fonts, each=10)
    return sure_from(read_by(reader, tune.batch(2 * tests, np.random.default_rng([SCORED_SEED, 13]))))


def read_by(reader: Reader, crops: Crops) -> Measured:
    """What it makes of them."""
    return Measured(reader.probabilities(crops[0]), *crops[1:])


def held_out(
    reader: Reader, source: Source, seed: int, tests: int, rendered: Crops | None, lights: Crops | None = None
) -> dict[str, Measured]:
    """What it makes of hard crops, of half as many clean ones, and of rendered ones where there are any."""
    sets = {
        "hard": source.batch(tests, np.random.default_rng([seed, 5])),
        "clean": source.batch(tests // 2, np.random.default_rng([seed, 6]), hard=0.0),
        "rendered": rendered,
        "rendered_lights": lights,
    }
    return {name: read_by(reader, each) for name, each in sets.items() if each is not None}


def lights_alone(reader: Reader, source: Source, seed: int, tests: int) -> dict[str, Measured]:
    """What it makes of drawn lights, in hard conditions and on fine days: among all signs they are too few to tell."""
    return {
        name: read_by(reader, source.batch(tests, np.random.default_rng([seed, 15, hard]), float(hard), lights=True))
        for name, hard in (("lights", 1), ("lights_clean", 0))
    }


if __name__ == "__main__":
    sys.exit(main())
