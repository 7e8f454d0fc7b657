"""The weather from one camera's pictures: visibility, rain, wet road, night, each with how sure it is, or unknown.

Boosted trees over `weather_features` judge single pictures (`training.weather.train` grows them); the pictures of some
seconds are weighed together, because weather stays while traffic and lens change. What the pictures cannot tell is left
unset: visibility by night, where lamps reach further than contrast; snow, of which no picture was learned from; and
everything in pictures unlike all that were learned from.
"""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np

from proto.weather import CameraWeather, Within
from services.perception.detect.detector import DetectorError, Picture
from services.perception.detect.loading import open_session
from services.perception.range.camera import Camera, Floats
from services.perception.weather.features import Numbers, features

OPEN_M = 100_000.0
"""The upper end where pictures no longer change with visibility."""
SUREST = 0.98
"""No probability is told nearer to 0 or 1: pictures alone never are."""
NIGHT_FROM, DAY_TO = 0.7, 0.3
WINDOW_NS = 10_000_000_000
MOST = 8
NS = 1_000_000_000


class Odds(msgspec.Struct, frozen=True, kw_only=True):
    """How the mean log-odds of n pictures becomes a probability: sigmoid(mean * (slope + gain ln n) + offset)."""

    slope: float
    gain: float
    offset: float

    def probability(self, mean: float, count: int) -> float:
        """Within what may be told."""
        told = 1.0 / (
            1.0 + math.exp(-float(np.clip(mean * (self.slope + self.gain * math.log(count)) + self.offset, -30, 30)))
        )
        return min(max(told, 1.0 - SUREST), SUREST)


class Margin(msgspec.Struct, frozen=True, kw_only=True):
    """By how much (ln m) an interval is widened where its middle is told below `to_m`."""

    to_m: float
    low: float
    high: float


class Card(msgspec.Struct, frozen=True, kw_only=True):
    """What training measured: beside the network, as JSON."""

    sha256: str
    outputs: tuple[str, ...]
    odds: Mapping[str, Odds]
    visibility: tuple[Margin, ...]
    rain: Margin
    confidence: float
    """Share of intervals that held the truth on pictures kept back from growing the trees; aimed at."""
    clear_m: float
    """Visibilities above this are not distinguished."""
    usual_low: tuple[float, ...]
    usual_high: tuple[float, ...]
    unusual_share: float
    """A picture of which more than this share of the numbers lies outside what is usual is unlike all others."""


class WeatherModel:
    """Judges single pictures."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Load an ONNX file and its card. Raises DetectorError where either cannot be used."""
        self._session = open_session(path, threads)
        beside = path.with_suffix(".json")
        try:
            self.card = msgspec.convert(json.loads(beside.read_text(encoding="utf-8")), Card, strict=False)
        except (OSError, ValueError) as error:
            raise DetectorError(f"{beside}: {error}") from None
        self._low, self._high = np.array(self.card.usual_low), np.array(self.card.usual_high)

    def judge(self, picture: Picture, camera: Camera) -> dict[str, float] | None:
        """The raw outputs by name; None for a picture unlike those that were learned from."""
        numbers = features(picture, camera)
        return self.outputs(numbers[None])[0] if self.usual(numbers) else None

    def usual(self, numbers: Numbers) -> bool:
        """Whether a picture's numbers lie where those of the training pictures do."""
        outside = (numbers < self._low) | (numbers > self._high) | ~np.isfinite(numbers)
        return float(outside.mean()) <= self.card.unusual_share

    def outputs(self, rows: Numbers) -> list[dict[str, float]]:
        """Of rows of features (N, F)."""
        told: Floats = self._session.run(None, {"features": rows})[0]
        return [dict(zip(self.card.outputs, map(float, row), strict=True)) for row in told]


class WeatherWindow:
    """Weighs the pictures of the last seconds of one camera."""

    def __init__(self, card: Card, camera: str) -> None:
        self._card, self._camera = card, camera
        self._judged: deque[tuple[int, dict[str, float] | None]] = deque(maxlen=MOST)

    def add(self, stamp_ns: int, judged: dict[str, float] | None) -> CameraWeather:
        """Take one picture's judgement; what all of them tell. A stamp before the last one starts anew."""
        if self._judged and stamp_ns < self._judged[-1][0]:
            self._judged.clear()
        self._judged.append((stamp_ns, judged))
        while stamp_ns - self._judged[0][0] > WINDOW_NS:
            self._judged.popleft()
        known = [each for _, each in self._judged if each is not None]
        if not known or 2 * len(known) < len(self._judged):
            return CameraWeather(camera=self._camera, reasons=("the pictures are unlike those learned from",))
        return weigh(self._card, self._camera, known)


def weigh(card: Card, camera: str, judged: list[dict[str, float]]) -> CameraWeather:
    """What the judgements of one camera's pictures tell together; at least one."""
    means = {name: float(np.mean([each[name] for each in judged])) for name in card.outputs}
    chances = {name: odds.probability(means[name], len(judged)) for name, odds in card.odds.items()}
    night = chances["night"]
    reasons = [f"{len(judged)} pictures"]
    if night > DAY_TO:
        reasons.append("by night or dusk lamps outshine the air: visibility unknown")
    return CameraWeather(
        camera=camera,
        visibility_m=None if night > DAY_TO else _visibility(card, judged),
        rain=chances["rain"],
        rain_mm_h=_rate(card, means) if chances["rain"] > 0.5 else None,
        wet_road=chances["wet"],
        night=True if night >= NIGHT_FROM else (False if night <= DAY_TO else None),
        reasons=tuple(reasons),
    )


def _visibility(card: Card, judged: list[dict[str, float]]) -> Within:
    low, middle, high = (
        float(np.median([each[name] for each in judged]))
        for name in ("visibility_low", "visibility", "visibility_high")
    )
    margin = margin_of(card.visibility, math.exp(middle))
    furthest = math.exp(max(high, middle) + margin.high)
    return Within(
        low=math.exp(min(low, middle) - margin.low),
        high=furthest if furthest < card.clear_m else OPEN_M,
        confidence=card.confidence,
    )


def margin_of(margins: tuple[Margin, ...], told_m: float) -> Margin:
    """The margin for what is told; the last one beyond all."""
    return next((margin for margin in margins if told_m < margin.to_m), margins[-1])


def _rate(card: Card, means: Mapping[str, float]) -> Within:
    low, high = means["rain_low"] - card.rain.low, means["rain_high"] + card.rain.high
    return Within(low=math.exp(min(low, high)), high=math.exp(max(low, high)), confidence=card.confidence)
