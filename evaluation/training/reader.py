"""Trains the sign reader on drawn signs and writes ``models/reader.onnx`` and ``models/reader.json``.

``python -m evaluation.training.reader --out models`` (extras ``simulator`` and ``train``). Crops are made first
(no torch needed: ``--only-crops``), then learned for a fixed number of steps, so that a seed gives the same network on
the same computer and library versions. The score table is measured with letterings and backgrounds that training never
saw, on the exported file, through ONNX Runtime.
"""

import argparse
import hashlib
import json
import logging
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from evaluation.training.reader_samples import Source
from evaluation.training.reader_scores import Measured, score_table
from evaluation.training.reader_tracks import track_table
from services.drivelm.classes import READER_CLASSES
from services.drivelm.reader import Reader

_log = logging.getLogger("reader")
Crops = tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float32]]
"""Crops, class indexes, sizes in pixels."""
FONT_FOLDERS = (Path("/usr/share/fonts"),)


def main(arguments: list[str] | None = None) -> int:
    """Make crops, train, calibrate, export, score."""
    options = _options(arguments)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    cv2.setNumThreads(1)
    crops, labels = _training_crops(options)
    if options.only_crops:
        return 0
    from evaluation.training import reader_fit

    started = time.monotonic()
    rendered = crops_of(options.rendered)
    more = None if rendered is None else (rendered[0], rendered[1])
    network = reader_fit.fit((crops, labels), more, options.steps, options.batch, options.seed)
    _log.info("trained in %.0f s", time.monotonic() - started)
    fresh = Source("train", options.seed + 7, options.fonts, each=12)
    held = fresh.batch(options.calibration, np.random.default_rng([options.seed, 3]))
    temperature = reader_fit.temperature(network, held[0], held[1])
    options.out.mkdir(parents=True, exist_ok=True)
    reader_fit.export(network, temperature, options.out / "reader.onnx")
    _write_card(options, temperature, time.monotonic() - started, fresh.letters.keys())
    return 0


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("models"))
    parser.add_argument("--cache", type=Path, default=Path("out/reader"), help="where the crops are kept")
    parser.add_argument("--fonts", type=Path, nargs="*", default=FONT_FOLDERS)
    parser.add_argument("--crops", type=int, default=100_000)
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--batch", type=int, default=96)
    parser.add_argument("--calibration", type=int, default=6000)
    parser.add_argument("--tests", type=int, default=8000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rendered", type=Path, help="crops of rendered pictures (reader_rendered) to train on too")
    parser.add_argument("--rendered-test", type=Path, help="such crops of the split test, to score")
    parser.add_argument("--only-crops", action="store_true")
    options = parser.parse_args(arguments)
    options.fonts = tuple(options.fonts)
    return options


def crops_of(path: Path | None) -> Crops | None:
    """The file that `reader_rendered` wrote, if one is named."""
    if path is None:
        return None
    with np.load(path) as stored:
        return stored["crops"], stored["labels"], stored["sizes"]


def _training_crops(options: argparse.Namespace) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Crops from the cache, or drawn now: half of them in easy conditions, half in the full mixture."""
    folder: Path = options.cache
    crops_file, labels_file = folder / f"crops-{options.seed}.npy", folder / f"labels-{options.seed}.npy"
    if labels_file.is_file():
        return np.load(crops_file, mmap_mode="r"), np.load(labels_file)
    folder.mkdir(parents=True, exist_ok=True)
    source = Source("train", options.seed, options.fonts)
    chance = np.random.default_rng([options.seed, 2])
    shape = (options.crops, 48, 48, 3)
    crops = np.lib.format.open_memmap(crops_file, mode="w+", dtype=np.uint8, shape=shape)
    labels = np.zeros(options.crops, np.int64)
    for start in range(0, options.crops, 1000):
        count = min(1000, options.crops - start)
        part = slice(start, start + count)
        crops[part], labels[part], _ = source.batch(count, chance, hard=(start // 1000) % 2 * 0.6 + 0.4)
        if start % 10_000 == 0:
            _log.info("%d crops", start)
    crops.flush()
    np.save(labels_file, labels)
    return crops, labels


def _write_card(options: argparse.Namespace, temperature: float, took_s: float, letters: object) -> None:
    """The model's card: classes, recipe, scores on held-out letterings, digest."""
    path: Path = options.out / "reader.onnx"
    card = {
        "classes": list(READER_CLASSES),
        "crop_px": 48,
        "input": "float32 N x 3 x 48 x 48, RGB, 0..255",
        "output": "probabilities N x classes, temperature included",
        "temperature": round(temperature, 4),
        "seed": options.seed,
        "recipe": {
            "command": f"python -m evaluation.training.reader --crops {options.crops} --steps {options.steps} "
            f"--batch {options.batch} --seed {options.seed}",
            "letterings": sorted(letters),  # type: ignore[call-overload]
            "rendered_crops": _count(options.rendered),
            "training_s": round(took_s),
        },
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "size_bytes": path.stat().st_size,
        "licence": "Apache-2.0; trained only on signs drawn by this project",
    }
    text = json.dumps(card, indent=1)
    (options.out / "reader.json").write_text(text + "\n", encoding="utf-8")
    reader = Reader.load(path)
    source = Source("test", options.seed, options.fonts, each=10)
    measured = held_out(reader, source, options.seed, options.tests, crops_of(options.rendered_test))
    tables = {name: {"crops": len(each.labels), **score_table(each)} for name, each in measured.items()}
    card["scores"] = {"held_out_letterings": sorted(source.letters), **tables.pop("hard")}
    card |= {f"scores_{name}": table for name, table in tables.items()}
    card["tracks"] = track_table(reader, source, 300, options.seed)
    (options.out / "reader.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    _log.info("%s", json.dumps(card["scores"], indent=1))


def held_out(reader: Reader, source: Source, seed: int, tests: int, rendered: Crops | None) -> dict[str, Measured]:
    """What it makes of hard crops, of half as many clean ones, and of rendered ones where there are any."""
    sets = {
        "hard": source.batch(tests, np.random.default_rng([seed, 5])),
        "clean": source.batch(tests // 2, np.random.default_rng([seed, 6]), hard=0.0),
    }
    if rendered is not None:
        sets["rendered"] = rendered
    return {name: Measured(reader.probabilities(each[0]), *each[1:]) for name, each in sets.items()}


def _count(path: Path | None) -> int:
    stored = crops_of(path)
    return 0 if stored is None else len(stored[0])


if __name__ == "__main__":
    sys.exit(main())
