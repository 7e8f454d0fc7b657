"""`python -m evaluation.latencies measure|show FILE`: what calls take on this machine, for `drivemcp evaluate --latencies FILE`."""

import argparse
import sys
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from evaluation.latencies.measure import measure
from evaluation.latencies.measured import Latencies, lines, read

DEFAULT = Path("out/latencies.json")


def main(arguments: list[str] | None = None) -> int:
    """Measure, or show; 2 where the file cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.latencies", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    first = commands.add_parser("measure", help="drive short runs on an idle machine and write the table")
    first.add_argument("--seconds", type=float, default=30.0, help="of each run (30)")
    first.add_argument("--out", type=Path, default=DEFAULT, metavar="FILE", help=f"where it goes ({DEFAULT})")
    commands.add_parser("show", help="print a table").add_argument("file", type=Path)
    flags = parser.parse_args(arguments)
    try:
        found = read(flags.file) if flags.command == "show" else _measured(flags.seconds)
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    if flags.command == "measure":
        flags.out.parent.mkdir(parents=True, exist_ok=True)
        flags.out.write_bytes(msgspec.json.format(msgspec.json.encode(found)))
        sys.stderr.write(f"{flags.out}\n")
    sys.stdout.write("\n".join([found.told(), "", *lines(found)]) + "\n")
    return 0


def _measured(seconds: float) -> Latencies:
    for each in measure(seconds):
        if isinstance(each, Latencies):
            return each
        sys.stderr.write(f"driving {each}\n")
    raise AssertionError("a measurement ends with its table")


if __name__ == "__main__":
    sys.exit(main())
