"""Fit the model of observations to runs, and check it beside them.

Each RUN is a recording (`record` writes one), a drive kept by `studies.tracking` (.msgpack, seen again), or the log of a
lockstep run (.mcap, its `spec.json` beside it; its truth is driven again).
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from drivemcp.errors import DriveMcpError, UserError
from drivemcp.paths import data
from evaluation.modelled_sensors.card import read_card
from evaluation.modelled_sensors.hosted import CARD
from evaluation.run.spec import RunSpec
from studies.modelled_sensors import recording
from studies.modelled_sensors.again import see_again
from studies.modelled_sensors.compare import figures, sheet
from studies.modelled_sensors.fit import fit, save
from studies.modelled_sensors.imagined import imagine
from studies.modelled_sensors.recording import Recording
from studies.modelled_sensors.retold import retell
from studies.modelled_sensors.tune import tuned
from studies.output import add_json, show


def opened(path: Path) -> Recording:
    """The recording of a run. Raises UserError."""
    if path.suffix == ".msgpack":
        return see_again(path)
    if path.suffix == ".mcap":
        return retell(path, _spec(path))
    return recording.load(path)


def _spec(log: Path) -> RunSpec:
    for folder in log.parents[:3]:
        if (folder / "spec.json").exists():
            return msgspec.json.decode((folder / "spec.json").read_bytes(), type=RunSpec)
    raise UserError(f"{log}: no spec.json beside it says which run it is of")


def _record(flags: argparse.Namespace) -> None:
    from evaluation.run.host import drive

    spec = RunSpec(scenario=flags.scenario, seed=flags.seed, seconds=flags.seconds, sensors=flags.sensors)
    told = Recording(spec=spec)
    drive(spec, flags.out.with_suffix(""), recording.listener(told))
    recording.save(told, flags.out)
    sys.stdout.write(f"{flags.out}: {len(told.truths)} steps, {len(told.boxes)} pictures, {len(told.facts)} facts\n")


def _keep(flags: argparse.Namespace) -> None:
    for run in flags.runs:
        path = flags.out / f"{run.stem}.rec"
        recording.save(opened(run), path)
        sys.stdout.write(f"{path}\n")


def _fit(flags: argparse.Namespace) -> None:
    runs = [opened(run) for run in flags.runs]
    card = tuned(fit(runs), runs)
    save(card, flags.out)
    sys.stdout.write(f"{flags.out}: fitted to {len(runs)} runs; faces are {card.reading.legible} times as legible\n")


def _check(flags: argparse.Namespace) -> None:
    runs, card = [opened(run) for run in flags.runs], read_card(flags.card or data(CARD))
    drawn = [imagine(run, card, seed) for run in runs for seed in range(1, flags.seeds + 1)]
    show([sheet(figures(runs), figures(drawn))], as_json=flags.json)


def _flags() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m studies modelled_sensors",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True)
    record = commands.add_parser("record", help="drive a run and keep truth beside what was seen")
    record.add_argument("scenario")
    record.add_argument("--seed", type=int, default=1)
    record.add_argument("--seconds", type=float, default=60.0)
    record.add_argument("--sensors", choices=("rendered", "model"), default="rendered")
    record.add_argument("--out", type=Path, required=True, help="file of the recording")
    record.set_defaults(act=_record)
    for name, act, about in (
        ("keep", _keep, "make recordings of runs"),
        ("fit", _fit, "fit the model to runs"),
        ("check", _check, "lay the model beside the runs"),
    ):
        command = commands.add_parser(name, help=about)
        command.add_argument("runs", nargs="+", type=Path, metavar="RUN")
        command.set_defaults(act=act)
        if name == "check":
            command.add_argument("--card", type=Path, help="the model (default: the shipped one)")
            command.add_argument("--seeds", type=int, default=2, help="how often the model draws each run")
            add_json(command)
        else:
            command.add_argument("--out", type=Path, required=True)
    return parser


def main(arguments: Sequence[str]) -> int:
    """Exit status: 0 done, 2 it cannot be."""
    flags = _flags().parse_args(arguments)
    try:
        flags.act(flags)
    except (DriveMcpError, OSError) as error:
        sys.stderr.write(f"studies.modelled_sensors: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
