"""The model's numbers from recordings of rendered runs, and the reader's table from its card."""

import hashlib
import json
import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from drivemcp.codehash import code_hash
from drivemcp.paths import data
from evaluation.observed.card import (
    FEATURES,
    Card,
    Clutter,
    Finding,
    Ghost,
    Line,
    LooksLike,
    Ranging,
    Reading,
    Reads,
    features,
)
from evaluation.observed.pairing import Look, Stray, looks
from evaluation.observed.recording import Recording
from evaluation.observed.regression import Floats, linear, logistic, memory_s
from proto.perception import ObjectClass
from proto.truth import Truth
from services.simulator.session import CAMERAS

ENOUGH = 40
"""Pictures of a class below which a camera's own fit is not tried: another camera's stands in."""
SCALE_PX = 20.0
SMALLEST_SCORE = 0.3
MODELS = ("detector.onnx", "reader.onnx", "weather.onnx")
FITTED = ("evaluation.observed", "services.perception", "services.drivelm")
NEAREST_GHOST_M = 3.0
WILD_SPREADS, WILD_LEAST = 5.0, 0.03
"""A range that is off by more than these spreads and this share is another thing's."""
LASTING_S = 5.0
SWEEP_AGE_S = 0.09
"""By how much the sweep is older than the picture: so far off were the ranges of those that drive, per metre a second."""
ENOUGH_OF_ONE, MOST_OWN = 10, 2.5
"""Pictures of a thing from which it tells how things differ; and the most that is believed of that."""
ALIKE, SURE, UNSURE = 0.3, 0.97, 0.6
"""Ours: with a larger share of a face's own, more signs are believed wrongly than the reader's drives had (1 %). The
reader's table calls a reading sure from 0.9 on."""
_NOTHING = Line(weights=tuple(0.0 for _ in FEATURES))
_NEVER = Line(weights=(-9.0, *_NOTHING.weights[1:]))
RIDGE = np.array([1e-3, 1.0, 1.0, 1.0, 1.0, 20.0, 20.0, 20.0])
"""How many pictures pull a weight to nothing: the weathers of a few runs tell little."""
SHAPE_RIDGE = np.array([1e-3, 1.0, 1.0, 1.0, 1.0, 1e6, 1e6, 1e6])
"""Where boxes lie depends on no weather."""


def fit(recordings: Sequence[Recording], *, legible: float = 1.0) -> Card:
    """The card of all recordings. Every recording counts by its pictures."""
    seen: list[Look] = []
    stray: list[list[Stray]] = []
    for recording in recordings:
        rows = list(looks(recording))
        seen += [look for found, _ in rows for look in found]
        stray.append([each for _, strays in rows for each in strays])
    minutes = sum(_minutes(recording) for recording in recordings)
    return Card(
        found=_found(seen),
        ranged={kind: _ranged([each for each in seen if each.thing.kind == kind]) for kind in get_args(ObjectClass)},
        clutter={name: _clutter(stray, name, minutes) for name in CAMERAS},
        reading=reading(legible),
        weather=tuple(row for recording in recordings for row in _weather(recording)),
        provenance=provenance(recordings, seen),
    )


def row_of(look: Look) -> tuple[float, ...]:
    """The features of a thing in a picture."""
    thing = look.thing
    return features(math.log(max(thing.full_height_px, 1.0) / SCALE_PX), thing.hidden, thing.cut, look.air)


def provenance(recordings: Sequence[Recording], seen: Sequence[Look]) -> dict[str, object]:
    """Which runs, with which code and models, and how much they show."""
    return {
        "runs": [
            {"scenario": each.spec.scenario, "seed": each.spec.seed, "seconds": round(60 * _minutes(each), 1)}
            for each in recordings
        ],
        "code": code_hash(*FITTED),
        "models": {name: hashlib.sha256(data(f"models/{name}").read_bytes()).hexdigest() for name in MODELS},
        "features": list(FEATURES),
        "looks": len(seen),
        "found": sum(each.box is not None for each in seen),
    }


# -- boxes -----------------------------------------------------------------------------------------------------------


def _found(seen: Sequence[Look]) -> dict[str, Finding]:
    """By camera and class; where a camera saw too little of a class, all cameras together."""
    told = {}
    for kind in get_args(ObjectClass):
        both = [each for each in seen if each.thing.kind == kind]
        for name in CAMERAS:
            own = [each for each in both if each.camera == name]
            enough = sum(each.box is not None for each in own) >= ENOUGH
            rows = own if enough else both
            if any(each.box is not None for each in rows):
                told[f"{name}/{kind}"] = _finding(rows)
    return told


def _finding(rows: Sequence[Look]) -> Finding:
    x = np.array([row_of(each) for each in rows])
    y = np.array([float(each.box is not None) for each in rows])
    seen = _odds(rows, x, y)
    hits = [each for each in rows if each.box is not None]
    xs, measures = x[y > 0.5], np.array([_measures(each) for each in hits])
    return Finding(
        seen=seen,
        score=_line(hits, xs, measures[:, 0]),
        height=_line(hits, xs, measures[:, 1]),
        aside=_line(hits, xs, measures[:, 2]),
        foot=_line(hits, xs, measures[:, 3]),
        own=round(_own(rows, x, y, seen), 4),
        pictures=len(rows),
        things=len({each.thing.key for each in rows}),
    )


def _own(rows: Sequence[Look], x: Floats, y: Floats, seen: Line) -> float:
    """By how much things differ: what their pictures are found more or less often than a chain of that memory would vary."""
    shares = 1.0 / (1.0 + np.exp(-np.clip(x @ np.array(seen.weights), -30, 30)))
    above, chance_alone, reach = 0.0, 0.0, 0.0
    for times, rest, spreads in _chains(rows, y - shares, np.sqrt(shares * (1 - shares))):
        if len(times) < ENOUGH_OF_ONE:
            continue
        kept = math.exp(-float(np.median(np.diff(times))) / seen.memory_s)
        variance = float((spreads**2).sum())
        above += float(rest.sum()) ** 2
        chance_alone += variance * (1 + kept) / (1 - kept)
        reach += variance**2
    return min(math.sqrt(max(above - chance_alone, 0.0) / max(reach, 1e-9)), MOST_OWN)


def _measures(look: Look) -> tuple[float, float, float, float]:
    """Log-odds of the score, logarithm of the height's ratio, offsets of middle and lower edge in true heights."""
    box, thing = look.box, look.thing
    assert box is not None
    x0, _, x1, y1 = thing.box
    score = min(max(box.score, 0.01), 0.99)
    high = max(thing.height_px, 1.0)
    return (
        math.log(score / (1 - score)),
        math.log(max(box.y1_px - box.y0_px, 1.0) / high),
        ((box.x0_px + box.x1_px) - (x0 + x1)) / 2 / high,
        (box.y1_px - y1) / high,
    )


def _line(rows: Sequence[Look], x: Floats, y: Floats) -> Line:
    weights, sigma = linear(x, y, SHAPE_RIDGE)
    spreads = np.full(len(y), max(sigma, 1e-6))
    memory = memory_s(_chains(rows, y - x @ weights, spreads))
    return Line(weights=_rounded(weights), sigma=round(sigma, 5), memory_s=round(memory, 4))


def _chains(rows: Sequence[Look], left: Floats, spreads: Floats) -> Iterable[tuple[Floats, Floats, Floats]]:
    chains: dict[tuple[str, str], list[tuple[float, float, float]]] = defaultdict(list)
    for each, rest, spread in zip(rows, left.tolist(), spreads.tolist(), strict=True):
        chains[each.camera, each.thing.key].append((each.stamp_ns / 1e9, rest, spread))
    for chain in chains.values():
        times, rests, scales = np.array(chain).T
        yield times, rests, scales


def _rounded(weights: Floats) -> tuple[float, ...]:
    return tuple(round(float(weight), 5) for weight in weights)


def _ranged(rows: Sequence[Look]) -> Ranging:
    mine = [each for each in rows if each.box is not None and each.box.range_m is not None]
    lidar = np.array([float(each.box.range_source == "lidar") for each in mine if each.box is not None])
    far = [each for each, measured in zip(mine, lidar.tolist(), strict=True) if measured]
    if not far:
        return Ranging(lidar=_NEVER, lidar_error=_NOTHING, wild=_NEVER, pictures=len(mine))
    x, off = np.array([row_of(each) for each in far]), np.array([_range_error(each) for each in far])
    error = _line(far, x, off)
    rest = off - x @ np.array(error.weights)
    wild = np.abs(rest) > max(WILD_SPREADS * error.sigma, WILD_LEAST)
    return Ranging(
        lidar=_odds(mine, np.array([row_of(each) for each in mine]), lidar),
        lidar_error=Line(weights=error.weights, sigma=round(_common(far, rest, ~wild), 5), memory_s=LASTING_S),
        jitter=round(_jitter(far, rest), 5),
        wild=_odds(far, x, wild.astype(float)),
        wild_errors=tuple(round(float(each), 4) for each in np.quantile(off[wild], np.linspace(0, 1, 41)))
        if wild.any()
        else (),
        pictures=len(mine),
    )


def _odds(rows: Sequence[Look], x: Floats, y: Floats) -> Line:
    weights = logistic(x, y, RIDGE)
    shares = 1.0 / (1.0 + np.exp(-np.clip(x @ weights, -30, 30)))
    memory = memory_s(_chains(rows, y - shares, np.sqrt(np.maximum(shares * (1 - shares), 0.03))))
    return Line(weights=_rounded(weights), memory_s=round(memory, 4))


def _common(rows: Sequence[Look], rest: Floats, tame: NDArray[np.bool_]) -> float:
    """Spread of what the pictures of each thing have in common, each thing weighed by its pictures."""
    chains: dict[tuple[str, str], list[float]] = defaultdict(list)
    for each, value, counts in zip(rows, rest.tolist(), tame.tolist(), strict=True):
        if counts:
            chains[each.camera, each.thing.key].append(value)
    middles = [float(np.median(chain)) for chain in chains.values() for _ in chain]
    return float(np.quantile(middles, 0.75) - np.quantile(middles, 0.25)) / 1.349 if len(middles) > 3 else 0.0


def _jitter(rows: Sequence[Look], rest: Floats) -> float:
    """Spread of what differs from picture to picture, from the differences of neighbours."""
    steps = [np.diff(left)[np.diff(times) < 0.5] for times, left, _ in _chains(rows, rest, rest)]
    apart = np.abs(np.concatenate(steps)) if steps else np.zeros(0)
    return float(np.median(apart)) / 0.6745 / math.sqrt(2.0) if len(apart) else 0.0


def _range_error(look: Look) -> float:
    """Share by which a measured range is off; what the thing drove since the sweep the tracker knows of, and it is no error."""
    box, camera = look.box, CAMERAS[look.camera]
    assert box is not None
    assert box.range_m is not None
    u = (box.x0_px + box.x1_px - camera.width_px) / 2 / camera.focal_px
    v = (box.y0_px + box.y1_px - camera.height_px) / 2 / camera.focal_px
    return (box.range_m / math.hypot(1.0, u, v) + look.thing.ahead_mps * SWEEP_AGE_S) / look.thing.depth_m - 1.0


# -- what is not there -----------------------------------------------------------------------------------------------


def _clutter(runs: Sequence[Sequence[Stray]], camera: str, minutes: float) -> Clutter:
    """The boxes of nothing, joined by their track where they have one."""
    ghosts = []
    for strays in runs:
        chains: dict[tuple[str, int], list[Stray]] = defaultdict(list)
        for k, each in enumerate(strays):
            if each.camera == camera:
                chains[each.box.kind, each.box.track_id or -k].append(each)
        ghosts += [_ghost(chain) for _, chain in sorted(chains.items())]
    return Clutter(per_minute=round(len(ghosts) / max(minutes, 1e-9), 4), ghosts=tuple(ghosts))


def _ghost(chain: Sequence[Stray]) -> Ghost:
    first, last = chain[0], chain[-1]
    box = first.box
    return Ghost(
        kind=box.kind,
        box=(round(box.x0_px, 1), round(box.y0_px, 1), round(box.x1_px, 1), round(box.y1_px, 1)),
        score=round(float(np.mean([each.box.score for each in chain])), 3),
        range_m=round(max(box.range_m, NEAREST_GHOST_M), 2) if box.range_m is not None else None,
        lidar=box.range_source == "lidar",
        seconds=round((last.stamp_ns - first.stamp_ns) / 1e9, 2),
    )


# -- reading ---------------------------------------------------------------------------------------------------------


def reading(legible: float) -> Reading:
    """The reader's measured table (`models/reader.json`: `scores`, letterings never trained on)."""
    card = json.loads(data("models/reader.json").read_text(encoding="utf-8"))["scores"]
    heads = ("all_signs", "limit", "limit_board", "zone", "led", "light", "plate")
    return Reading(
        rows={head: tuple(map(_reads, card[head])) for head in heads},
        taken_for_a_sign=card["other"]["taken_for_a_sign_surely"],
        legible=legible,
        alike=ALIKE,
        sure=SURE,
        unsure=UNSURE,
    )


def _reads(row: dict[str, Any]) -> Reads:
    low, high = (float(part) for part in row["px"].split("-"))
    return Reads(
        px=math.sqrt(low * high), right=row["right"], sure_right=row["sure_right"], sure_wrong=row["sure_wrong"]
    )


# -- weather ---------------------------------------------------------------------------------------------------------


def weather_name(truth: Truth) -> str:
    """The weather as the camera's is told apart."""
    if truth.dark:
        return "dark_rain" if (truth.rain_mm_h or 0.0) > 0.1 else "dark"
    if (truth.rain_mm_h or 0.0) > 0.1:
        return "rain"
    return "wet" if (truth.film_mm or 0.0) > 0.03 else "dry"


def _weather(recording: Recording) -> Iterable[LooksLike]:
    truths = dict(recording.truths)
    for stamp_ns, told in recording.camera_weather:
        truth = truths.get(stamp_ns)
        if truth is not None and truth.visibility_m is not None:
            yield LooksLike(weather=weather_name(truth), open_m=round(truth.visibility_m, 1), told=told)


def _minutes(recording: Recording) -> float:
    return (recording.truths[-1][0] - recording.truths[0][0]) / 60e9 if recording.truths else 0.0


def save(card: Card, path: Path) -> None:
    """Write it for people too."""
    from msgspec import json as coded

    path.write_bytes(coded.format(coded.encode(card), indent=1) + b"\n")
