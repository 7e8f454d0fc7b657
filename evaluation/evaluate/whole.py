"""What `drivemcp evaluate` does: drive what is missing, measure, write."""

import argparse
import signal
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import msgspec

from app.drive.screen import Screen
from drivemcp.errors import UserError
from evaluation.campaign import published
from evaluation.campaign.feedback import specs_of
from evaluation.campaign.machine import cores
from evaluation.campaign.one import run_one
from evaluation.campaign.plan import Row, Run, latencies_of, runs_of
from evaluation.campaign.pool import Done, Job, Pool
from evaluation.campaign.published import Line
from evaluation.campaign.replacing import check_writable, write_whole
from evaluation.campaign.spread import Spread
from evaluation.campaign.store import Store
from evaluation.evaluate import asked, held
from evaluation.report import page, report
from evaluation.run.spec import RunSpec
from evaluation.tables import files
from evaluation.tables.tables import Ran, Table, table_of

REPORT = "report.html"


def evaluate(flags: argparse.Namespace, beside: Sequence[held.Part] = ()) -> int:
    """Drive, measure, write; the exit status. With goals of other tables `beside`, the page begins with what holds of all."""
    screen, folder = Screen(), Path(flags.out)
    _check_files(flags)
    lines = _published(flags)
    store = Store(folder / "runs", published.taken(lines, flags.again))
    asked.check(flags)
    rows = [row for name in asked.tables_of(flags.table) for row in asked.rows(name, flags)]
    if not rows:
        raise UserError(f"--method: the table {flags.table} has no row of {', '.join(flags.method)}")
    runs = runs_of(rows, asked.amount(flags))
    if flags.published:
        screen.say(f"{flags.published}: {published.fit(lines)}")
    if note := asked.recorded_otherwise(flags):
        screen.say(note)
    asked.check_again(flags, lines, _by_key(runs, store))
    with store.alone():
        try:
            with interruptible():
                _drive_in_turn(runs, store, flags, screen)
        finally:
            specs = {store.key(spec): spec for spec in specs_of(runs, store).values()}
            tables = _measured(rows, runs, _keys(runs, store), store)
            taken = published.told(flags.published, lines, specs, store)
            try:  # first what took hours to drive
                otherwise = _publish(specs, lines, store, flags, screen)
            finally:
                _write(tables, folder, store, flags, screen, taken, beside)
    return int(bool(otherwise) or any(row.missing for table in tables for row in table.rows))


def _check_files(flags: argparse.Namespace) -> None:
    """What cannot be read, kept or written is told now, not after hours. Raises UserError."""
    if flags.again and not flags.published:
        raise UserError("--again is about runs of --published; name the file")
    if flags.publish:
        check_writable("--publish", Path(flags.publish))
    if flags.docs:
        page.reading_of(Path(flags.docs))


def _published(flags: argparse.Namespace) -> dict[str, Line]:
    """The lines of --published; the file that --publish names, too, need not be there yet. Raises UserError now, not after hours."""
    there = _there(flags)
    if flags.published == flags.publish:
        return there
    return published.read(Path(flags.published)) if flags.published else {}


def _there(flags: argparse.Namespace) -> dict[str, Line]:
    """What the file to publish into holds by now."""
    return published.read(Path(flags.publish)) if flags.publish and Path(flags.publish).exists() else {}


def _publish(
    specs: Mapping[str, RunSpec], lines: Mapping[str, Line], store: Store, flags: argparse.Namespace, screen: Screen
) -> list[str]:
    """Compare the runs that are here with what is published of them, add them where it is asked for; those that came out otherwise."""
    kept = {key: store.here(key) for key in specs}
    here = [published.line_of(key, specs[key], found) for key, found in kept.items() if found is not None]
    otherwise = sorted({*published.otherwise(lines, here), *published.otherwise(_there(flags), here)})
    for key in otherwise:
        screen.say(f"{key} came out otherwise here than it was published: {store.path(key)}")
    if flags.publish:
        elsewhere = [line for key, line in lines.items() if key in specs and store.here(key) is None]
        screen.say(f"{published.publish(Path(flags.publish), [*here, *elsewhere])} runs are new in {flags.publish}")
    return otherwise


@contextmanager
def interruptible() -> Iterator[None]:
    """SIGINT and SIGTERM end the driving, however this process was started: a shell's background job would ignore SIGINT."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    previous = [(number, signal.signal(number, stop)) for number in (signal.SIGINT, signal.SIGTERM)]
    try:
        yield
    finally:
        for number, handler in previous:
            signal.signal(number, handler)


def _by_key(runs: Sequence[Run], store: Store) -> dict[str, Run]:
    """The runs that are known by now, each with the spec that it has by now."""
    specs = specs_of(runs, store)
    known = (msgspec.structs.replace(run, spec=specs[id(run)]) for run in runs if id(run) in specs)
    return {store.key(run.spec): run for run in known}


def _keys(runs: Sequence[Run], store: Store) -> dict[int, str]:
    """By `id`, of the runs that are known by now."""
    return {run: store.key(spec) for run, spec in specs_of(runs, store).items()}


def _drive_in_turn(runs: Sequence[Run], store: Store, flags: argparse.Namespace, screen: Screen) -> None:
    """Drive what is missing; a row that adapts has its next run only once the last one is driven."""
    tried: set[str] = set()
    while True:
        ready = {key: run for key, run in _by_key(runs, store).items() if key not in tried}
        if not ready:
            return
        _drive(ready, store, flags, screen)
        tried |= ready.keys()


def _drive(runs: Mapping[str, Run], store: Store, flags: argparse.Namespace, screen: Screen) -> None:
    """Drive the runs that are not there. A run that several rows share is driven once."""
    jobs = [Job(key, run.spec) for key, run in runs.items() if store.kept(key) is None]
    taken = sum(store.here(key) is None for key in runs) - len(jobs)
    also = f", {taken} are published" if flags.published else ""
    screen.say(f"{len(runs)} runs, {len(runs) - len(jobs) - taken} of them are there{also}; in {store.folder}")
    started_s, failed = time.monotonic(), 0
    for count, done in enumerate(_ends(jobs, store, flags), 1):
        store.note(done.key, done.problem)
        failed += bool(done.problem)
        if done.problem:
            screen.say(f"{_named(runs[done.key])} failed: {done.problem.strip().splitlines()[-1]}")
        screen.live(_progress(count, len(jobs), failed, started_s, runs[done.key]))
    screen.end_live()


def _ends(jobs: Sequence[Job], store: Store, flags: argparse.Namespace) -> Iterable[Done]:
    folder = str(store.folder.resolve())
    spread = Spread(folder, flags.ray, run_one) if flags.ray else Pool(folder, flags.jobs or cores(), run_one)
    return spread.done(jobs)


def _progress(count: int, total: int, failed: int, began_s: float, last: Run) -> str:
    left = time_left(count, total, began_s)
    return f"{count} of {total} runs{f', {failed} failed' if failed else ''}; {left}; last: {_named(last)}"


def time_left(done: int, total: int, began_s: float) -> str:
    """How long the rest will take by what was done since then (monotonic)."""
    left_s = (time.monotonic() - began_s) / max(1, done) * max(0, total - done)
    hours, minutes = int(left_s // 3600), left_s % 3600 / 60
    return f"about {f'{hours} h {minutes:.0f} min' if hours else f'{minutes:.1f} min'} left"


def _named(run: Run) -> str:
    return f"{run.row.table}, {run.row.label}, {run.spec.scenario}"


def _measured(rows: Sequence[Row], runs: Sequence[Run], keys: Mapping[int, str], store: Store) -> list[Table]:
    by_row: dict[tuple[str, str], list[Ran]] = {}
    for run in runs:
        key = keys.get(id(run), "")
        ran = Ran(
            key=key, number=run.number, seed=run.spec.seed, kept=store.kept(key), problem=store.failed(key),
            seconds=run.spec.seconds,
        )  # fmt: skip
        by_row.setdefault((run.row.table, run.row.key), []).append(ran)
    names = dict.fromkeys(row.table for row in rows)
    return [
        table_of(
            name,
            [row for row in rows if row.table == name],
            {key: ran for (table, key), ran in by_row.items() if table == name},
        )
        for name in names
    ]


def _write(
    tables: Sequence[Table],
    folder: Path,
    store: Store,
    flags: argparse.Namespace,
    screen: Screen,
    taken: str,
    beside: Sequence[held.Part],
) -> None:
    measured = latencies_of(flags.latencies)
    latencies = measured.told() if measured is not None else "fixed, 4 ms a call"
    told = report.about(
        tables,
        asked.command_line(flags),
        quick=flags.quick,
        latencies=latencies,
        published=taken,
        cassette=asked.cassette_of(flags),
    )
    files.write(folder, tables)
    write_whole(folder / REPORT, report.html(tables, told, store.folder, folder).encode())
    if flags.docs:
        holds = held.lines([*beside, ("The paper's tables", [*held.of_tables(tables)])]) if beside else ()
        page.write(Path(flags.docs), tables, told, holds)
    missing = f"; {told.missing} are missing: the same command goes on" if told.missing else ""
    screen.say(f"{told.runs} runs, {told.km:.2f} km{missing}")
    sys.stdout.write(f"{folder / REPORT}\n")
