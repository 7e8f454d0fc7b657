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
from training.weather.train import read_pictures

COLUMNS = (
    "weather", "cases", "visibility off, median", "interval holds", "lower end too far", "high / low", "wet right", "wet told dry",
    "rain right", "rain told none", "unknown",
)  # fmt: skip


def table(cases: Sequence[Case]) -> Iterator[str]:
    """Markdown rows, one a weather, then all."""
    yield f"| {' | '.join(COLUMNS)} |"
    yield "|" + "---|" * len(COLUMNS)
    for name, _ in GROUPS:
        yield _row(name, figures([case for case in cases if case.group == name]))
    yield _row("all", figures(cases))


def _row(name: str, of: Figures) -> str:
    shares = (
        of.held,
        of.too_good,
        of.wide,
        of.wet_right,
        of.wet_called_dry,
        of.rain_right,
        of.rain_called_none,
        of.unknown,
    )
    told = [f"{value:.1f}" if number == 2 else _percent(value) for number, value in enumerate(shares)]
    return f"| {name} | {of.cases} | {_percent(of.error)} | {' | '.join(told)} |".replace("nan", "-")


def _percent(value: float) -> str:
    return "-" if np.isnan(value) else f"{100 * value:.1f}%"


def sums(cases: Sequence[Case]) -> Iterator[str]:
    """How honest the probabilities are."""
    for name in ("wet", "rain"):
        yield f"{name}: area under ROC {area(cases, name):.3f}, expected calibration error {calibration_error(cases, name):.3f}"
    yield f"rain intensity within its interval: {_percent(rate_held(cases))}; told dry or none: probability at most {DRY}"


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
    flags = parser.parse_args()
    try:
        model = WeatherModel(flags.model)
        if flags.photographs:
            sys.stdout.writelines(line + "\n" for line in of_photographs(model, flags.photographs))
            return 0
        if flags.cache is None:
            parser.error("--cache or --photographs is needed")
        pictures = read_pictures(flags.cache, "test")
    except (UserError, FileNotFoundError) as error:
        sys.stderr.write(f"studies.camera_weather: {error}\n")
        return 2
    for most in (1, 6):
        cases = cases_of(model, pictures, most)
        sys.stdout.write(f"\nAfter at most {most} pictures:\n\n")
        sys.stdout.writelines(line + "\n" for line in (*table(cases), "", *sums(cases)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
