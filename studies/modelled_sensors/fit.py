"""The model's numbers from recordings of rendered runs, and the reader's table from its card."""

import hashlib
import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from drivemcp.paths import data
from evaluation.modelled_sensors.card import (
    FEATURES,
    HALF_HIDDEN,
    PACES_MPS,
    Card,
    Finding,
    Line,
    LooksLike,
    Ranging,
    Reading,
    Reads,
    Seen,
    Surroundings,
    pace_of,
    surroundings_of,
    weather_name,
)
from evaluation.run.behaviour import behaviour
from proto.perception import ObjectClass
from services.simulator.session import CAMERAS
from studies.modelled_sensors.clutter import clutter
from studies.modelled_sensors.lines import chains, measure, odds, rows_of, shares_of
from studies.modelled_sensors.pairing import Look, Stray, looks
from studies.modelled_sensors.ranging import ENOUGH, ranging
from studies.modelled_sensors.recording import Recording
from training.regression import Floats

MODELS = ("detector.onnx", "people.onnx", "signs.onnx", "lights.onnx", "reader.onnx", "weather.onnx")
ENOUGH_OF_ONE, MOST_OWN = 10, 2.5
"""Pictures of a thing from which it tells how things differ; and the most that is believed of that."""
ALIKE, SURE, UNSURE = 0.3, 0.97, 0.6
"""Ours: with a larger share of a face's own, more signs are believed wrongly than the reader's drives had (1 %). The
reader's table calls a reading sure from 0.9 on."""


def fit(recordings: Sequence[Recording], *, legible: float = 1.0) -> Card:
    """The card of all recordings. Every recording counts by its pictures."""
    seen: list[Look] = []
    stray: list[list[Stray]] = []
    for recording in recordings:
        rows = list(looks(recording))
        seen += [look for found, _ in rows for look in found]
        stray.append([each for _, strays in rows for each in strays])
    minutes = _minutes_driven(recordings)
    return Card(
        found=_found(seen),
        ranged=_ranged(seen),
        clutter={name: clutter(stray, name, minutes) for name in CAMERAS},
        reading=reading(legible),
        weather=tuple(row for recording in recordings for row in _weather(recording)),
        provenance=provenance(recordings, seen),
    )


def provenance(recordings: Sequence[Recording], seen: Sequence[Look]) -> dict[str, object]:
    """Which runs, with which code and models, and how much they show."""
    return {
        "runs": [
            {"scenario": each.spec.scenario, "seed": each.spec.seed, "seconds": round(60 * _minutes(each), 1)}
            for each in recordings
        ],
        "behaviour": behaviour(),
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


def _ranged(seen: Sequence[Look]) -> dict[str, Ranging]:
    """By camera and class; where a camera measured too few of a class, all cameras together."""
    told = {}
    for kind in get_args(ObjectClass):
        both = [each for each in seen if each.thing.kind == kind and each.box is not None]
        for name in CAMERAS:
            own = [each for each in both if each.camera == name]
            told[f"{name}/{kind}"] = ranging(own if len(own) >= ENOUGH else both)
    return told


def _finding(rows: Sequence[Look]) -> Finding:
    """Of all looks of a class in a camera."""
    hidden = [each for each in rows if each.thing.hidden >= HALF_HIDDEN]
    hits = [each for each in rows if each.box is not None]
    x, measures = rows_of(hits), np.array([_measures(each) for each in hits])
    seen = _seen([each for each in rows if each.thing.hidden < HALF_HIDDEN] or rows)
    return Finding(
        seen=seen,
        hidden=_seen(hidden) if len(hidden) >= ENOUGH else seen,
        score=measure(hits, x, measures[:, 0]),
        height=measure(hits, x, measures[:, 1]),
        aside=measure(hits, x, measures[:, 2]),
        foot=measure(hits, x, measures[:, 3]),
        pictures=len(rows),
        things=len({each.thing.key for each in rows}),
    )


def _seen(rows: Sequence[Look]) -> Seen:
    x = rows_of(rows)
    y = np.array([float(each.box is not None) for each in rows])
    line = odds(rows, x, y)
    return Seen(odds=line, own=round(_own(rows, x, y, line), 4))


def _own(rows: Sequence[Look], x: Floats, y: Floats, seen: Line) -> float:
    """By how much things differ: what their pictures are found more or less often than a chain of that memory would vary."""
    shares = shares_of(x, np.array(seen.weights))
    above, chance_alone, reach = 0.0, 0.0, 0.0
    for times, rest, spreads in chains(rows, y - shares, np.sqrt(shares * (1 - shares))):
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


def _weather(recording: Recording) -> Iterable[LooksLike]:
    truths = dict(recording.truths)
    for stamp_ns, told in recording.camera_weather:
        truth = truths.get(stamp_ns)
        if truth is not None and truth.visibility_m is not None:
            yield LooksLike(weather=weather_name(truth), open_m=round(truth.visibility_m, 1), told=told)


def _minutes_driven(recordings: Sequence[Recording]) -> dict[Surroundings, list[float]]:
    """By surroundings and pace."""
    minutes = {where: [0.0 for _ in PACES_MPS] for where in get_args(Surroundings)}
    for recording in recordings:
        for _, truth in recording.truths:
            at_pace = minutes[surroundings_of(truth.law_limit_mps)]
            at_pace[pace_of(truth.speed_mps)] += _minutes(recording) / len(recording.truths)
    return minutes


def _minutes(recording: Recording) -> float:
    return (recording.truths[-1][0] - recording.truths[0][0]) / 60e9 if recording.truths else 0.0


def save(card: Card, path: Path) -> None:
    """Write it for people too."""
    from msgspec import json as coded

    path.write_bytes(coded.format(coded.encode(card), indent=1) + b"\n")
