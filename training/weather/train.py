"""Grows the trees that read the weather from pictures, and measures how far they may be trusted.

`python -m training weather.train --cache DIR` reads the shards of `training.weather.frames` (split "train") and
writes `models/weather.onnx` and its card. Trees judge single pictures. How sequences of them become probabilities and
intervals is fitted on the pictures of `--tune DIR`. These are shards of split "test", with shapes and places that the trees
never saw and that the measuring must not see again. scikit-learn on one thread takes a minute.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from drivemcp.paths import data
from services.perception.range.camera import Camera
from services.perception.weather.camera_weather import Card, Margin, Odds
from services.perception.weather.features import features
from services.simulator.environment.weather import WET_FROM_MM
from services.simulator.scene.scene import FRONT
from services.simulator.sensors.measurements import calibration
from training.bins import Bools, Floats
from training.dataset.shards import shard_frames, shards
from training.weather.trees import write_trees

WET_FROM = 1.0 - float(np.exp(-WET_FROM_MM / 0.1))
"""The renderer's wetness of that film (`services.simulator.environment.weather.atmosphere`)."""
RAIN_FROM_MM_H = 0.1
CLEAR_M = 4000.0
TOLD_M = (30.0, 6000.0)
SEED = 5
COVERAGE = 0.9
BANDS_M = (150.0, 400.0, 1200.0, 1e9)
USUAL = 0.002
STRANGE = 0.998
"""Quantiles: of each number, and of a picture's share of unusual ones."""
TREES: Mapping[str, Any] = {
    "learning_rate": 0.06, "max_iter": 150, "max_leaf_nodes": 12, "min_samples_leaf": 15, "l2_regularization": 5.0,
    "max_features": 0.3, "early_stopping": False, "random_state": SEED,
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Numbers (N, F) of N pictures, their notes, and the truth read from these."""

    numbers: NDArray[np.float32]
    notes: list[dict[str, Any]]

    def of(self, name: str) -> Floats:
        """One note of all pictures."""
        return np.array([note[name] for note in self.notes], dtype=np.float64)

    @property
    def truths(self) -> dict[str, Bools]:
        """Of each yes-or-no question."""
        return {
            "wet": self.of("wetness") >= WET_FROM,
            "rain": self.of("rain_mm_h") >= RAIN_FROM_MM_H,
            "night": self.of("night") > 0.5,
        }

    @property
    def visibility(self) -> Floats:
        """Its logarithm, within what can be told."""
        return np.log(np.clip(self.of("visibility_m"), *TOLD_M))

    def sequences(self) -> list[list[int]]:
        """Indices of pictures in a row that share a weather."""
        rows: dict[str, list[int]] = {}
        for index, note in enumerate(self.notes):
            rows.setdefault(str(note["place"]), []).append(index)
        return list(rows.values())


def read_pictures(folder: Path, split: str) -> Pictures:
    """All shards of a split. Raises FileNotFoundError without shards."""
    paths = shards(folder, split)
    if not paths:
        raise FileNotFoundError(f"no {split} pictures in {folder}; python -m training weather.frames makes some")
    cv2.setNumThreads(1)
    read = [(features(picture, camera_of(note)), note) for path in paths for picture, _, note in shard_frames(path)]
    return Pictures(np.array([numbers for numbers, _ in read]), [note for _, note in read])


def camera_of(note: Mapping[str, Any]) -> Camera:
    """The camera of a picture as its calibration tells it."""
    focal_px = float(note["focal_px"])
    mounted = {"z_m": float(note["z_m"]), "pitch_rad": float(note["pitch_rad"])}
    return Camera.of(msgspec.structs.replace(calibration(FRONT), fx_px=focal_px, fy_px=focal_px, **mounted))


def grow(pictures: Pictures) -> dict[str, Any]:
    """All heads: log-odds of the questions, quantiles of visibility by day and of rain in rain."""
    from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor

    numbers, truths = pictures.numbers, pictures.truths
    heads: dict[str, Any] = {
        name: HistGradientBoostingClassifier(**TREES).fit(numbers, truth) for name, truth in truths.items()
    }
    by_day, in_rain = ~truths["night"], truths["rain"]
    quantiles = [
        ("visibility_low", 0.05, by_day, pictures.visibility), ("visibility", 0.5, by_day, pictures.visibility),
        ("visibility_high", 0.95, by_day, pictures.visibility),
        ("rain_low", 0.05, in_rain, np.log(pictures.of("rain_mm_h") + 1e-3)),
        ("rain_high", 0.95, in_rain, np.log(pictures.of("rain_mm_h") + 1e-3)),
    ]  # fmt: skip
    for name, quantile, rows, target in quantiles:
        model = HistGradientBoostingRegressor(loss="quantile", quantile=quantile, **TREES)
        heads[name] = model.fit(numbers[rows], target[rows], sample_weight=_evenly(target[rows]))
    return heads


def _evenly(values: Floats) -> Floats:
    """Weights that make rare values (thick fog, cloudbursts) count half as much again as their share, in the root."""
    counts, edges = np.histogram(values, bins=12)
    place = np.clip(np.digitize(values, edges[1:-1]), 0, len(counts) - 1)
    return np.asarray(np.sqrt(counts.mean() / np.maximum(counts[place], 1)), dtype=np.float64)


def told(heads: Mapping[str, Any], numbers: NDArray[np.float32]) -> dict[str, Floats]:
    """What each head says of rows of numbers, as the ONNX graph does."""
    return {name: np.ravel(getattr(head, "decision_function", head.predict)(numbers)) for name, head in heads.items()}


def prefixes(pictures: Pictures) -> Iterator[list[int]]:
    """The first one, two, ... pictures of each sequence."""
    for rows in pictures.sequences():
        yield from (rows[:count] for count in range(1, len(rows) + 1))


def fit_odds(judged: Floats, truth: Bools, pictures: Pictures) -> Odds:
    """A logistic curve of the mean log-odds and of how many there were; each sequence counts as one."""
    from scipy.optimize import minimize

    rows = list(prefixes(pictures))
    means = np.array([judged[row].mean() for row in rows])
    counts = np.array([len(row) for row in rows])
    weights = np.array([1.0 / length for rows_ in pictures.sequences() for length in [len(rows_)] * len(rows_)])
    right = np.array([truth[row[0]] for row in rows])

    def loss(weigh: Floats) -> float:
        odds = means * (weigh[0] + weigh[1] * np.log(counts)) + weigh[2]
        return float(np.sum(weights * np.logaddexp(0.0, np.where(right, -odds, odds))) + 0.1 * weigh[1] ** 2)

    slope, gain, offset = minimize(loss, np.array([1.0, 0.0, 0.0]), method="BFGS").x
    return Odds(slope=float(slope), gain=float(gain), offset=float(offset))


def margin(low: Floats, high: Floats, truth: Floats, to_m: float = 1e9) -> Margin:
    """How far intervals must be widened to hold the truth as often as is said (split conformal), each side for itself."""
    side = min(1.0, 1.0 - (1.0 - COVERAGE) / 2 + 1.0 / max(len(truth), 1))
    return Margin(
        to_m=to_m,
        low=max(0.0, float(np.quantile(low - truth, side))),
        high=max(0.0, float(np.quantile(truth - high, side))),
    )


def margins(judged: Mapping[str, Floats], pictures: Pictures) -> tuple[Margin, ...]:
    """Of visibility by day, for each band of what is told."""
    day = ~pictures.truths["night"]
    rows = [row for row in prefixes(pictures) if day[row[0]]]
    middle = np.array([np.median(judged["visibility"][row]) for row in rows])
    low = np.minimum(np.array([np.median(judged["visibility_low"][row]) for row in rows]), middle)
    high = np.maximum(np.array([np.median(judged["visibility_high"][row]) for row in rows]), middle)
    truth = pictures.visibility[[row[0] for row in rows]]
    band = np.digitize(np.exp(middle), BANDS_M[:-1])
    return tuple(margin(low[band == k], high[band == k], truth[band == k], to_m) for k, to_m in enumerate(BANDS_M))


def card_of(grown: Pictures, pictures: Pictures, judged: Mapping[str, Floats], sha256: str) -> Card:
    """What is usual by the pictures that the trees were grown from, all else by others and what the trees say of them."""
    rainy = pictures.truths["rain"]
    low, high = np.quantile(grown.numbers, (USUAL, 1.0 - USUAL), axis=0)
    outside = ((pictures.numbers < low) | (pictures.numbers > high)).mean(axis=1)
    rate = np.log(pictures.of("rain_mm_h")[rainy] + 1e-3)
    return Card(
        sha256=sha256,
        outputs=tuple(judged),
        odds={name: fit_odds(judged[name], truth, pictures) for name, truth in pictures.truths.items()},
        visibility=margins(judged, pictures),
        rain=margin(judged["rain_low"][rainy], judged["rain_high"][rainy], rate),
        confidence=COVERAGE,
        clear_m=CLEAR_M,
        usual_low=tuple(round(float(value), 4) for value in low),
        usual_high=tuple(round(float(value), 4) for value in high),
        unusual_share=float(np.quantile(outside, STRANGE)),
    )


def main() -> None:
    """Grow, judge unseen places, write model and card."""
    parser = argparse.ArgumentParser(prog="python -m training weather.train", description=__doc__)
    parser.add_argument("--cache", type=Path, required=True, help="folder of the shards")
    parser.add_argument(
        "--tune", type=Path, required=True, help="folder of shards that probabilities and intervals are fitted on"
    )
    parser.add_argument("--out", type=Path, default=data("models") / "weather.onnx")
    flags = parser.parse_args()
    pictures, tune = read_pictures(flags.cache, "train"), read_pictures(flags.tune, "test")
    heads = grow(pictures)
    write_trees(flags.out, heads, pictures.numbers.shape[1])
    digest = hashlib.sha256(flags.out.read_bytes()).hexdigest()
    card = card_of(pictures, tune, told(heads, tune.numbers), digest)
    recipe = {
        "train_pictures": len(pictures.notes), "tune_pictures": len(tune.notes), "seed": SEED, "trees": TREES,
        "wet_from": WET_FROM, "rain_from_mm_h": RAIN_FROM_MM_H, "frames": "training.weather.frames, split train",
    }  # fmt: skip
    content = msgspec.json.encode(msgspec.to_builtins(card) | {"recipe": recipe})
    flags.out.with_suffix(".json").write_bytes(msgspec.json.format(content, indent=1) + b"\n")
    sys.stdout.write(f"{len(pictures.notes)} pictures, {flags.out.stat().st_size / 1e6:.2f} MB\n")


if __name__ == "__main__":
    main()
