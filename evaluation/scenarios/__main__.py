"""`python -m evaluation.scenarios show|write|check|drive`: look at generated scenarios, keep, check and drive them."""

import argparse
import sys
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from evaluation.scenarios.check import faults
from evaluation.scenarios.generate import generate
from evaluation.scenarios.names import FAMILIES, LAYOUTS, SPLITS, Place, read_place
from evaluation.scenarios.plan_view import as_svg, as_text
from evaluation.scenarios.through import drive_through
from services.simulator.scenario.plan import Scenario


def main(argv: list[str] | None = None) -> int:
    """Run one command; 0: all is well."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.scenarios", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    show = commands.add_parser("show", help="print the plan of a scenario")
    show.add_argument("--svg", type=Path, help="draw it from above into this file instead")
    write = commands.add_parser("write", help="write it as a file that `drivemcp up --scenario FILE.json` drives")
    write.add_argument("--file", type=Path, required=True)
    drive = commands.add_parser("drive", help="drive it to its end without sensors and assistant")
    drive.add_argument("--seed", type=int, default=1)
    for command in (show, write, drive):
        command.add_argument("name", help="family/split/number, e.g. urb-rain/development/3")
    commands.add_parser("check", help="check all layouts of all families")
    arguments = parser.parse_args(argv)
    try:
        return _run(arguments)
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2


def _run(arguments: argparse.Namespace) -> int:
    if arguments.command == "check":
        return _check()
    place = read_place(arguments.name)
    if place is None:
        raise UserError(f"no scenario {arguments.name!r}: family/split/number, families {', '.join(FAMILIES)}")
    scenario = generate(place.family, place.number, place.split)
    if arguments.command == "drive":
        _say(drive_through(scenario, place.world_seed(arguments.seed)))
    elif arguments.command == "write":
        _write("--file", arguments.file, msgspec.json.format(msgspec.json.encode(scenario)))
    else:
        _show(scenario, arguments.svg)
    return 0


def _write(flag: str, file: Path, content: bytes) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    except OSError as error:
        raise UserError(f"{flag} {file}: cannot be written: {error.strerror or error}") from error


def _say(what: object) -> None:
    sys.stdout.write(f"{what}\n")


def _show(scenario: Scenario, svg: Path | None) -> None:
    if svg is None:
        _say(as_text(scenario))
    else:
        _write("--svg", svg, as_svg(scenario).encode())


def _check() -> int:
    """Every layout once in each split, and what is wrong with it."""
    places = [Place(family, split, number) for family in FAMILIES for split in SPLITS for number in range(LAYOUTS)]
    found = [f"{each}: {fault}" for each in places for fault in faults(generate(each.family, each.number, each.split))]
    _say("\n".join([*found, f"{len(places)} layouts, {len(found)} faults"]))
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
