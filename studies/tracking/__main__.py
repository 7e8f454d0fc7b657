"""`python -m studies tracking`: how well road users are tracked on rendered drives, as a table or as JSON.

Each scenario is driven with each seed, without advice, and perception is compared with the simulator's truth.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path

from drivemcp.errors import UserError
from drivemcp.paths import data
from services.perception.detect.loading import load_detector
from services.simulator.render import RendererUnavailable
from studies.output import add_json, show
from studies.tracking.measure import Measured, measure, sheet
from studies.tracking.recording import DriveName


def main() -> int:
    """Measure and print; 2 where something is missing."""
    flags = _parser().parse_args()
    try:
        found = _measured(flags)
    except (UserError, RendererUnavailable) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    show([sheet(found)], as_json=flags.json, figures=found)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies tracking", description=__doc__)
    parser.add_argument(
        "--scenario", nargs="+", default=["urb-rain"], help="by name, or a place: urb-rain/calibration/0"
    )
    parser.add_argument("--seed", nargs="+", type=int, default=[1])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--cut-ins", action="store_true", help="cars of the next lane are told to change into ours")
    parser.add_argument("--model", type=Path, default=None, help="a detector's ONNX file; ours by default")
    parser.add_argument(
        "--keep", type=Path, default=None, help="a folder for the drives, so that they are rendered once"
    )
    add_json(parser)
    return parser


def _measured(flags: argparse.Namespace) -> list[Measured]:
    detector = load_detector(flags.model or data("models/detector.onnx"))
    drives = [
        DriveName(scenario=scenario, seed=seed, seconds=flags.seconds, cut_ins=flags.cut_ins)
        for scenario, seed in itertools.product(flags.scenario, flags.seed)
    ]
    return [measure(name, detector, flags.keep) for name in drives]


if __name__ == "__main__":
    raise SystemExit(main())
