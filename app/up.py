"""`drivemcp up`: a scenario driven by the whole stack."""

import argparse
from pathlib import Path

from app.drive.precheck import check_asked, check_faults, check_scenario
from app.drive.run import add_common, drive
from app.drive.start import start_settings
from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.files.models import find_model
from drivemcp.numbers import number
from drivemcp.paths import data, has_data


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp up`."""
    parser = subparsers.add_parser("up", help="start the whole stack and drive a scenario")
    parser.add_argument(
        "--scenario", default="urb-rain", metavar="NAME|FILE", help="urb-rain, cross-border, dynamic-vsl, or a file"
    )
    parser.add_argument("--seconds", type=number(1.0, 86_400.0), default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="PRESET[:SEVERITY]@SECONDS",
        help="a fault of the car: low_tyre@10",
    )
    parser.add_argument("--lockstep", action="store_true", help="deterministic: the simulation waits for the stack")
    parser.add_argument(
        "--detector", default="", metavar="NAME|FILE", help="another detector than ours (drivemcp models list)"
    )
    add_common(parser)
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Drive a scenario."""
    check_asked(flags)
    is_file = flags.scenario.endswith((".toml", ".json"))
    if not is_file and not has_data(f"scenarios/{flags.scenario}.toml"):
        raise UserError(
            f"no scenario {flags.scenario!r}; there are urb-rain, cross-border, dynamic-vsl, or give a FILE.toml or .json"
        )
    if is_file and not Path(flags.scenario).is_file():
        raise UserError(f"no such scenario file: {flags.scenario}")
    found = check_scenario(Path(flags.scenario) if is_file else data(f"scenarios/{flags.scenario}.toml"))
    flags.set = [*start_settings(found.country, found.driver_language), *flags.set]
    check_faults(flags.fault)
    if flags.detector:
        flags.set = [*flags.set, f"perception.detector={find_model(flags.detector)}"]
    name = Path(flags.scenario).stem
    scenario = str(Path(flags.scenario).resolve()) if is_file else flags.scenario
    source = {"scenario": scenario, "seed": flags.seed, "seconds": flags.seconds, "autostart": True}
    if flags.fault:
        source["faults"] = flags.fault
    return drive(flags, name, "simulator", source, lockstep=flags.lockstep)[0]
