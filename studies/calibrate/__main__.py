"""Beside `drivemcp calibrate`:

python -m studies calibrate feedback --from RUNS      # Delta and c_min over a sequence of drives with labels from truth
python -m studies calibrate margins [--from RUNS]     # what Delta buys and costs where the arbiter alone decides
"""

import argparse
import sys
from pathlib import Path

from app.drive.precheck import check_folder_of, profile_of
from drivemcp.errors import DriveMcpError, UserError
from drivemcp.numbers import whole
from evaluation.campaign.plan import DELTAS
from evaluation.tables.columns import Column
from services.arbiter.profiles.profile import Profile
from studies.calibrate.feedback import from_truth, sequence, svg, swing
from studies.calibrate.margins import approached, as_if_asked, decided, pooled, sheet
from studies.calibrate.recordings import Recording, find, load
from studies.output import Cell, Sheet, add_json, show

SWING: tuple[str | Column, ...] = (
    "", *(Column(title=each, places=3) for each in ("least", "most", "bound below", "bound above", "last")),
    "reversals", Column(title="by more than", places=3), Column(title="span of the second half", places=3),
)  # fmt: skip


def main() -> int:
    """Print what was asked for; exit status 1 where feedback left a bound."""
    parser = argparse.ArgumentParser(prog="python -m studies calibrate", description=__doc__.partition("\n")[0])
    commands = parser.add_subparsers(dest="what", required=True)
    feedback = commands.add_parser("feedback", help="Delta and c_min over a sequence of drives")
    feedback.add_argument("--drives", type=whole(1, 10_000), default=40)
    feedback.add_argument("--svg", default="", metavar="FILE", help="plot of both over the drives")
    margins = commands.add_parser("margins", help="what Delta buys and costs where the arbiter alone decides")
    for command, needed in ((feedback, True), (margins, False)):
        command.add_argument("--from", dest="logs", nargs="+", required=needed, default=(), metavar="LOG|FOLDER")
        command.add_argument("--profile", default="calibrated", metavar="NAME|FILE")
        add_json(command)
    flags = parser.parse_args()
    try:
        profile = profile_of("--profile", flags.profile)
        return _feedback(flags, profile) if flags.what == "feedback" else _margins(flags, profile)
    except DriveMcpError as error:
        parser.error(str(error))


def _margins(flags: argparse.Namespace, profile: Profile) -> int:
    found = [approached(profile, delta) for delta in DELTAS]
    logs = find(flags.logs)
    drives = []
    for number, log in enumerate(logs, start=1):
        drive = as_if_asked(load(log), profile)
        drives.append([decided(drive, profile, delta) for delta in DELTAS])
        sys.stderr.write(f"{number} of {len(logs)} drives: {drive.name}\n")
    rows = [pooled(each) for each in zip(*drives, strict=True)]
    title = (
        f"{len(logs)} drives, {rows[0].km:.1f} km, decided again: road and driver are the recording's" if rows else ""
    )
    show([sheet(found, rows, title)], as_json=flags.json)
    return 0


def _feedback(flags: argparse.Namespace, profile: Profile) -> int:
    _check_file(flags.svg)
    recordings: list[Recording] = [load(log) for log in find(flags.logs)]
    found = sequence(from_truth(recordings, profile, flags.drives), profile, flags.drives)
    if flags.svg:
        Path(flags.svg).write_text(svg(found, profile), encoding="utf-8")
    rows, kept = list[tuple[Cell, ...]](), True
    for name, values, step, low, high in (
        ("Delta", [each.delta for each in found], profile.k_late, profile.delta_low, profile.delta_high),
        ("c_min", [each.c_min for each in found], profile.k_fp, profile.c_min_low, profile.c_min_high),
    ):
        told = swing(values, step)
        kept = kept and low <= told.low <= told.high <= high
        rows.append((name, told.low, told.high, low, high, told.last, told.turns, step, told.late_span))
    title = (
        f"{flags.drives} drives, of {len(recordings)} recorded ones in turn; {sum(each.given for each in found)} labels, "
        f"{sum(each.counted for each in found)} counted"
    )
    show([Sheet(SWING, rows, title=title)], as_json=flags.json)
    return int(not kept)


def _check_file(svg: str) -> None:
    """Before the drives, which take long: the plot can be written."""
    check_folder_of([svg])
    if svg and Path(svg).is_dir():
        raise UserError(f"--svg {svg} is a folder; name a file in it")


if __name__ == "__main__":
    sys.exit(main())
