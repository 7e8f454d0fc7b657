"""`drivemcp calibrate`: fit the arbiter's constants and the event thresholds on the calibration split."""

import argparse

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.numbers import whole
from evaluation.campaign.machine import cores


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp calibrate`."""
    parser = subparsers.add_parser(
        "calibrate",
        help="fit the arbiter's constants and the event thresholds",
        description="Drives places of the calibration split of all three families, decides every tick again with other constants, "
        "drives the best in closed loop beside the shipped ones, and writes profile.toml: the fitted constants where they are "
        "worse in no safety number, else the shipped ones. Interrupted, the same command goes on. "
        "Exit status: 0 written, 1 some drives failed, 130 interrupted.",
    )
    parser.add_argument(
        "--from",
        dest="logs",
        nargs="+",
        default=[],
        metavar="LOG|FOLDER",
        help="recorded drives to search on, with the truth beside them, instead of driving: of an earlier calibration or of a car, "
        "none of the development or test split",
    )
    parser.add_argument("--runs", type=whole(1, 10_000), default=4, help="places of each family (4)")
    parser.add_argument("--trials", type=whole(1, 1_000_000), default=300, help="candidates that are tried (300)")
    parser.add_argument(
        "--verify", type=whole(0, 10_000), default=4, help="places of each family driven in closed loop (4); 0: none"
    )
    parser.add_argument("--points", type=whole(2, 101), default=5, help="values of each constant in the plot (5)")
    parser.add_argument("--seed", type=whole(1, 2**31), default=1, help="of the search")
    parser.add_argument("--jobs", type=whole(1, 1024), default=cores(), help="processes side by side (one a core)")
    parser.add_argument("--sensors", choices=("model", "rendered"), default="model")
    parser.add_argument("--out", default="out/calibrate", metavar="DIR", help="where drives, trials and results go")
    parser.add_argument("--quick", action="store_true", help="drives of 5 s, four trials: shows that all of it works")
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Calibrate. Raises UserError where a module is not installed."""
    try:
        from studies.calibrate.whole import calibrate  # takes seconds: every other command would wait for it
    except ModuleNotFoundError as error:
        raise UserError(
            f"`drivemcp calibrate` needs the module {error.name!r}: pip install 'drivemcp[demo,calibrate]'"
        ) from error
    return calibrate(flags)
