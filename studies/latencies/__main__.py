"""`python -m studies latencies measure|show FILE`: what calls take on this machine, for `drivemcp evaluate --latencies FILE`."""

import argparse
import sys
from pathlib import Path

import msgspec

from drivemcp.errors import DriveMcpError, UserError
from drivemcp.numbers import number
from evaluation.campaign.replacing import check_writable, write_whole, writing
from evaluation.run.latencies import Latencies, read
from evaluation.tables.columns import Column
from studies.latencies.measure import measure
from studies.output import Sheet, add_json, show

DEFAULT = Path("out/latencies.json")


def main(arguments: list[str] | None = None) -> int:
    """Measure, or show; 1 where a run failed, 2 where the file cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m studies latencies", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    first = commands.add_parser("measure", help="drive short runs on an idle machine and write the table")
    first.add_argument("--seconds", type=number(1.0, 3600.0), default=30.0, help="of each run (30)")
    first.add_argument("--out", type=Path, default=DEFAULT, metavar="FILE", help=f"where it goes ({DEFAULT})")
    commands.add_parser("show", help="print a table").add_argument("file", type=Path)
    add_json(parser)
    flags = parser.parse_args(arguments)
    try:
        if flags.command == "show":
            show([sheet(read(flags.file))], as_json=flags.json)
        else:
            _measure(flags.seconds, flags.out, as_json=flags.json)
    except DriveMcpError as error:
        sys.stderr.write(f"{error}\n")
        return 2 if isinstance(error, UserError) else 1
    return 0


def _measure(seconds: float, out: Path, *, as_json: bool) -> None:
    """Print what is measured, then write it. Raises UserError where it cannot be written: before anything is driven, if that shows."""
    check_writable("--out", out)
    found = _measured(seconds)
    show([sheet(found)], as_json=as_json)
    with writing("--out", out):
        write_whole(out, msgspec.json.format(msgspec.json.encode(found)))
    sys.stderr.write(f"{out}\n")


def sheet(found: Latencies) -> Sheet:
    """What each stage and tool took, and what runs take for it."""
    taken = found.modelled_ms()
    rows = [
        (name, each.p50_ms, each.p99_ms, each.count, taken.get(name, "-" if name in found.stages else "fixed"))
        for name, each in {**found.stages, **found.tools}.items()
    ]
    ms = (Column(title="p50", unit="ms"), Column(title="p99", unit="ms"))
    return Sheet(("what", *ms, "count", Column(title="taken by runs", unit="ms", places=1)), rows, title=found.told())


def _measured(seconds: float) -> Latencies:
    for each in measure(seconds):
        if isinstance(each, Latencies):
            return each
        sys.stderr.write(f"driving {each}\n")
    raise AssertionError("a measurement ends with its table")


if __name__ == "__main__":
    sys.exit(main())
