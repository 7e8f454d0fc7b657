"""Judges sequences of held-out rendered pictures, and compares what is told with the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proto.weather import CameraWeather
from services.perception.weather.camera_weather import NS, WeatherModel, WeatherWindow
from training.bins import Bools, Floats, binned
from training.weather.train import CLEAR_M, RAIN_FROM_MM_H, WET_FROM, Pictures

DRY = 0.05
"""A probability of a wet road (or of rain) at most this is taken as saying that the road is dry (or that no rain falls)."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """What was told after the last picture of a sequence, how many there were, and the truth."""

    told: CameraWeather
    pictures: int
    note: Mapping[str, Any]

    @property
    def wet(self) -> bool:
        """Whether the road was."""
        return bool(self.note["wetness"] >= WET_FROM)

    @property
    def rain(self) -> bool:
        """Whether it rained."""
        return bool(self.note["rain_mm_h"] >= RAIN_FROM_MM_H)

    @property
    def group(self) -> str:
        """The row of the table: how the weather would be called."""
        return next(name for name, holds in GROUPS if holds(self.note))


GROUPS: Sequence[tuple[str, Any]] = (
    ("night", lambda note: note["night"] and note["wetness"] < WET_FROM),
    ("night, wet or rain", lambda note: note["night"]),
    ("fog below 150 m", lambda note: note["visibility_m"] < 150),
    ("fog 150 to 400 m", lambda note: note["visibility_m"] < 400),
    ("fog, rain 400 to 800 m", lambda note: note["visibility_m"] < 800),
    ("rain from 4 mm/h", lambda note: note["rain_mm_h"] >= 4),
    ("rain below 4 mm/h", lambda note: note["rain_mm_h"] > 0),
    ("wet after rain", lambda note: note["wetness"] >= WET_FROM),
    ("damp", lambda note: note["wetness"] > 0),
    ("low sun", lambda note: note["sun_deg"] < 12),
    ("dry", lambda note: True),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """Of some cases; NaN where nothing can be said."""

    cases: int
    error: float
    """Median of |told / true - 1| of visibility, told as the interval's geometric middle; where the truth is below `CLEAR_M`."""
    held: float
    """Share of visibility intervals that hold the truth."""
    too_good: float
    """Share whose lower end is above it."""
    wide: float
    """Median of high over low; an upper end beyond `CLEAR_M` counts as `CLEAR_M`."""
    wet_right: float
    rain_right: float
    wet_called_dry: float
    """Of wet roads, how many were told to be dry."""
    rain_called_none: float
    unknown: float
    """Share of cases of which nothing was told."""


def cases_of(model: WeatherModel, pictures: Pictures, most: int) -> list[Case]:
    """Each sequence, its first `most` pictures a second apart, through the window as the service does it."""
    judged = model.outputs(pictures.numbers)
    cases = []
    for rows in pictures.sequences():
        window = WeatherWindow(model.card, "front")
        for second, row in enumerate(rows[:most]):
            known = judged[row] if model.usual(pictures.numbers[row]) else None
            told = window.add(second * NS, known)
        cases.append(Case(told, len(rows[:most]), pictures.notes[rows[0]]))
    return cases


def figures(cases: Sequence[Case]) -> Figures:
    """The table's row of some cases."""
    seen = [case for case in cases if case.told.visibility_m is not None]
    wet = [case for case in cases if case.told.wet_road is not None]
    return Figures(
        cases=len(cases),
        error=_median([abs(_middle(case) / case.note["visibility_m"] - 1) for case in seen if _apart(case)]),
        held=_share([_holds(case) for case in seen]),
        too_good=_share([_low(case) > case.note["visibility_m"] for case in seen]),
        wide=_median(
            [min(case.told.visibility_m.high, CLEAR_M) / _low(case) for case in seen if case.told.visibility_m]
        ),
        wet_right=_share([((case.told.wet_road or 0.0) >= 0.5) == case.wet for case in wet]),
        rain_right=_share([((case.told.rain or 0.0) >= 0.5) == case.rain for case in wet]),
        wet_called_dry=_share([(case.told.wet_road or 0.0) <= DRY for case in wet if case.wet]),
        rain_called_none=_share([(case.told.rain or 0.0) <= DRY for case in wet if case.rain]),
        unknown=1.0 - len(wet) / len(cases) if cases else math.nan,
    )


def chances(cases: Sequence[Case], name: str) -> tuple[Floats, Bools]:
    """Probabilities told of "wet" or "rain", and whether it was so."""
    field = {"wet": "wet_road", "rain": "rain"}[name]
    known = [case for case in cases if getattr(case.told, field) is not None]
    return np.array([getattr(case.told, field) for case in known]), np.array([getattr(case, name) for case in known])


def calibration_error(cases: Sequence[Case], name: str) -> float:
    """Expected, over ten bins of equal width."""
    told, right = chances(cases, name)
    return binned(told, right).error if len(told) else math.nan


def area(cases: Sequence[Case], name: str) -> float:
    """Under the receiver operating characteristic: how often a yes is told surer than a no; ties count half."""
    told, right = chances(cases, name)
    yes, no = told[right], told[~right]
    if not len(yes) or not len(no):
        return math.nan
    return float(np.mean((yes[:, None] > no) + 0.5 * (yes[:, None] == no)))


def rate_held(cases: Sequence[Case]) -> float:
    """Share of told intervals of rain that hold the truth."""
    told = [(case.told.rain_mm_h, case.note["rain_mm_h"]) for case in cases if case.told.rain_mm_h is not None]
    return _share([within.low <= truth <= within.high for within, truth in told if within is not None])


def _low(case: Case) -> float:
    return case.told.visibility_m.low if case.told.visibility_m is not None else math.nan


def _middle(case: Case) -> float:
    within = case.told.visibility_m
    return math.sqrt(within.low * min(within.high, CLEAR_M)) if within is not None else math.nan


def _apart(case: Case) -> bool:
    return bool(case.note["visibility_m"] < CLEAR_M)


def _holds(case: Case) -> bool:
    within = case.told.visibility_m
    return within is not None and bool(within.low <= case.note["visibility_m"] <= within.high)


def _share(truths: Sequence[Any]) -> float:
    return float(np.mean(truths)) if len(truths) else math.nan


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else math.nan
