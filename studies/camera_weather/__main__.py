"""`python -m studies camera_weather --cache DIR`: what the camera tells of the weather in held-out rendered pictures, by weather.

`DIR` holds shards of `training.weather.frames --split test`. `--photographs FILE ...` tells instead what it says of pictures
whose camera is not calibrated, taking the one that is assumed for a dashcam.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import msgspec
import numpy as np

from drivemcp.errors import UserError
from drivemcp.paths import data
from evaluation.tables.columns import Column
from services.perception.range.camera import Camera
from services.perception.weather.camera_weather import WeatherModel, WeatherWindow
from studies.camera_weather.measure import (
    DRY,
    GROUPS,
    Case,
    Figures,
    area,
    calibration_error,
    cases_of,
    figures,
    rate_held,
)
from studies.output import Cell, Sheet, add_json, percent, show
from training.weather.train import read_pictures

COLUMNS = (
    "weather", "cases", percent("visibility off, median"), percent("interval holds"), percent("lower end too far"),
    Column(title="high / low", places=1), percent("wet right"), percent("wet told dry"), percent("rain right"),
    percent("rain told none"), percent("unknown"),
)  # fmt: skip


def sheet(cases: Sequence[Case], title: str) -> Sheet:
    """A row a weather, then all, then how honest the probabilities are."""
    groups = [(name, [case for case in cases if case.group == name]) for name, _ in GROUPS]
    rows = [_row(name, figures(of)) for name, of in (*groups, ("all", cases))]
    return Sheet(COLUMNS, rows, list(sums(cases)), title)


def _row(name: str, of: Figures) -> tuple[Cell, ...]:
    return (
        name, of.cases, of.error, of.held, of.too_good, of.wide, of.wet_right, of.wet_called_dry, of.rain_right,
        of.rain_called_none, of.unknown,
    )  # fmt: skip


def sums(cases: Sequence[Case]) -> Iterator[str]:
    """How honest the probabilities are."""
    for name in ("wet", "rain"):
        yield f"{name}: area under ROC {area(cases, name):.3f}, expected calibration error {calibration_error(cases, name):.3f}"
    yield f"rain intensity within its interval: {rate_held(cases):.1%}; told dry or none: probability at most {DRY}"


def of_photographs(model: WeatherModel, paths: Sequence[Path]) -> Iterator[str]:
    """What is told of each. Raises UserError naming one that does not open."""
    for path in paths:
        bgr = cv2.imread(str(path))
        if bgr is None:
            raise UserError(f"{path} is no picture that can be read")
        picture = cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)
        judged = model.judge(picture, Camera.assumed(picture.shape[1], picture.shape[0]))
        yield f"{path.name}: {msgspec.json.encode(WeatherWindow(model.card, 'front').add(0, judged)).decode()}"


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m studies camera_weather", description=__doc__)
    parser.add_argument("--cache", type=Path, help="folder of the shards")
    parser.add_argument("--model", type=Path, default=data("models") / "weather.onnx")
    parser.add_argument("--photographs", type=Path, nargs="+", default=[], metavar="FILE")
    add_json(parser)
    flags = parser.parse_args()
    try:
        model = WeatherModel(flags.model)
        if flags.photographs:
            show([Sheet((), (), list(of_photographs(model, flags.photographs)))], as_json=flags.json)
            return 0
        if flags.cache is None:
            parser.error("--cache or --photographs is needed")
        pictures = read_pictures(flags.cache, "test")
    except (UserError, FileNotFoundError) as error:
        sys.stderr.write(f"studies.camera_weather: {error}\n")
        return 2
    told = [sheet(cases_of(model, pictures, most), f"After at most {most} pictures:") for most in (1, 6)]
    show(told, as_json=flags.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
