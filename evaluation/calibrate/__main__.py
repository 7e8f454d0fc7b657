"""`python -m evaluation.calibrate feedback --from RUNS`: Delta and c_min over a sequence of drives with labels from truth."""

import argparse
import sys
from pathlib import Path

from drivemcp.errors import DriveMcpError
from evaluation.calibrate.feedback import from_truth, sequence, svg, swing
from evaluation.calibrate.recordings import find, load
from services.arbiter.profiles import load as load_profile


def main() -> int:
    """Print what feedback did; exit status 1 where a bound was left."""
    parser = argparse.ArgumentParser(description="Feedback over a sequence of drives.")
    parser.add_argument("what", choices=("feedback",))
    parser.add_argument("--from", dest="logs", nargs="+", required=True, metavar="LOG|FOLDER")
    parser.add_argument("--drives", type=int, default=40)
    parser.add_argument("--profile", default="calibrated", metavar="NAME|FILE")
    parser.add_argument("--svg", default="", metavar="FILE", help="plot of both over the drives")
    flags = parser.parse_args()
    try:
        recordings, profile = [load(log) for log in find(flags.logs)], load_profile(flags.profile)
        found = sequence(from_truth(recordings, profile, flags.drives), profile, flags.drives)
        if flags.svg:
            Path(flags.svg).write_text(svg(found, profile), encoding="utf-8")
    except DriveMcpError as error:
        parser.error(str(error))
    _say(f"{flags.drives} drives, of {len(recordings)} recorded ones in turn; {sum(each.given for each in found)} labels, "
         f"{sum(each.counted for each in found)} counted")  # fmt: skip
    kept = True
    for name, values, step, low, high in (
        ("Delta", [each.delta for each in found], profile.k_late, profile.delta_low, profile.delta_high),
        ("c_min", [each.c_min for each in found], profile.k_fp, profile.c_min_low, profile.c_min_high),
    ):
        told = swing(values, step)
        kept = kept and low <= told.low <= told.high <= high
        _say(f"{name}: {told.low:.3f} to {told.high:.3f} within [{low:g}, {high:g}], last {told.last:.3f}; "
             f"{told.turns} reversals by more than {step:g}; span of the second half {told.late_span:.3f}")  # fmt: skip
    return int(not kept)


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    sys.exit(main())
