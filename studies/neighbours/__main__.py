"""`python -m studies neighbours [--runs N]`: the same traffic with IDM alone and with an RSS-only governor, beside ours."""

import argparse
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path

import msgspec

from app.drive.screen import Screen
from drivemcp.errors import UserError
from drivemcp.numbers import number, whole
from evaluation.campaign import published
from evaluation.campaign.machine import cores, machine
from evaluation.campaign.plan import FIXED, latencies_of
from evaluation.campaign.pool import Job, Pool
from evaluation.campaign.store import Store
from evaluation.evaluate.asked import settings_in_runs
from evaluation.evaluate.command import MOST
from evaluation.evaluate.whole import interruptible, time_left
from evaluation.run.spec import RunSpec
from evaluation.scenarios import FAMILIES
from studies.neighbours.drive import key_of, run_any
from studies.neighbours.table import LABELS, cells, sheet, specs
from studies.output import add_json, show


def main(arguments: list[str] | None = None) -> int:
    """Drive what is missing, measure, write; 0: all runs are there, 1: some failed, 2: wrong use, 130: interrupted."""
    parser = argparse.ArgumentParser(prog="python -m studies neighbours", description=__doc__)
    parser.add_argument("--runs", type=whole(1, MOST), default=4, help="runs a family and row (4)")
    parser.add_argument("--family", action="append", choices=FAMILIES, help="only this one; may be repeated")
    parser.add_argument("--seconds", type=number(0.0, 86_400.0), default=0.0, help="of each run; 0: the whole route")
    parser.add_argument("--jobs", type=whole(1, MOST), default=cores(), help="runs side by side (one a core)")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/evaluate"),
        help="the folder of `drivemcp evaluate`, whose runs are shared",
    )
    parser.add_argument(
        "--latencies", default=FIXED, metavar="FILE", help="as of `drivemcp evaluate`, for the same runs"
    )
    parser.add_argument("--set", action="append", default=[], metavar="SERVICE.KEY=VALUE", help="the same")
    parser.add_argument("--published", default="", metavar="FILE", help="runs that need not be driven again, as there")
    add_json(parser)
    flags = parser.parse_args(arguments)
    try:
        settings_in_runs(flags.set)
        lines = published.read(Path(flags.published)) if flags.published else {}
        return _table(flags, Store(flags.out / "runs", published.taken(lines, ())))
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; finished runs are kept, and the same command goes on\n")
        return 130


def _table(flags: argparse.Namespace, store: Store) -> int:
    families, latencies = flags.family or FAMILIES, latencies_of(flags.latencies)
    rows = {
        (family, label): [
            (key_of(spec, store), spec)
            for spec in specs(label, (family,), flags.runs, flags.seconds, latencies, flags.set)
        ]
        for family in families
        for label in LABELS
    }
    with store.alone(), interruptible():
        failed = _drive(dict(run for runs in rows.values() for run in runs), store, flags.jobs)
    measured = {
        row: [kept.metrics for key, _ in runs if (kept := store.kept(key)) is not None] for row, runs in rows.items()
    }
    found = cells(measured)
    told = f"{flags.runs} runs a family and row, modelled sensors; {machine()}"
    flags.out.mkdir(parents=True, exist_ok=True)
    (flags.out / "neighbours.json").write_bytes(msgspec.json.format(msgspec.json.encode({"of": told, "rows": found})))
    show([sheet(found, told)], as_json=flags.json)
    return int(failed > 0)


def _drive(runs: Mapping[str, RunSpec], store: Store, jobs: int) -> int:
    """Those that are not there; how many failed."""
    screen, began_s, failed = Screen(), time.monotonic(), 0
    waiting: Iterable[Job] = [Job(key, spec) for key, spec in runs.items() if store.kept(key) is None]
    waiting = sorted(waiting, key=lambda job: int(job.spec.scenario.rpartition("/")[2]))
    screen.say(f"{len(runs)} runs, {len(runs) - len(waiting)} of them are there; in {store.folder}")
    for count, done in enumerate(Pool(str(store.folder.resolve()), jobs, run_any).done(waiting), 1):
        spec = runs[done.key]
        store.note(done.key, done.problem)
        failed += bool(done.problem)
        if done.problem:
            screen.say(f"{spec.method}, {spec.scenario} failed: {done.problem.strip().splitlines()[-1]}")
        left = time_left(count, len(waiting), began_s)
        screen.live(f"{count} of {len(waiting)} runs; {left}; last: {spec.method}, {spec.scenario}")
    screen.end_live()
    return failed


if __name__ == "__main__":
    sys.exit(main())
