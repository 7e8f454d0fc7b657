"""What `drivemcp calibrate` does: record, search, hold against closed loop, write."""

import argparse
import hashlib
import shlex
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import msgspec

from app.drive.screen import Screen
from drivemcp.errors import UserError
from evaluation.campaign.machine import commit, machine
from evaluation.campaign.store import Store
from evaluation.evaluate.whole import interruptible, time_left
from evaluation.run.spec import RunSpec
from services.arbiter.profiles.profile import Profile
from services.arbiter.profiles.profile import load as load_profile
from studies.calibrate import drives, files
from studies.calibrate.constants import ROWS, Candidate
from studies.calibrate.files import Curve, Provenance
from studies.calibrate.recordings import find, kilometres, load
from studies.calibrate.score import PARTS
from studies.calibrate.search import Found, Trial, Trials, on_cores, optimiser, search
from studies.calibrate.usable import CALIBRATION, usable
from studies.calibrate.verdict import Closed, Verdict, closed, verdict

BASE = "calibrated"
PROFILE, FITTED, PLOT, PROVENANCE = "profile.toml", "fitted.toml", "sensitivity.svg", "provenance.json"
QUICK_S = 5.0
QUICK_TRIALS = 4


class _Loop(NamedTuple):
    """Both in closed loop, and what follows."""

    before: Closed | None
    after: Closed | None
    verdict: Verdict
    failed: bool = False
    """Whether a drive in closed loop failed."""


def calibrate(flags: argparse.Namespace) -> int:
    """The exit status: 0 the constants are written, 1 drives failed."""
    screen, folder = Screen(), Path(flags.out)
    store, base = Store(folder / "runs"), load_profile(BASE)
    with store.alone(), interruptible():
        wanted = () if flags.logs else _recorded(flags)
        failed = _drive(store, wanted, flags, screen, "recording")
        logs, kind = _named(flags, screen) if flags.logs else (drives.logs(store, wanted), CALIBRATION)
        if not logs:
            raise UserError("no drive to calibrate on: all failed; see what they said above")
        recordings = [load(log) for log in logs]
        places, km = tuple(each.name for each in recordings), kilometres(recordings)
        sensors = ", ".join(sorted({each.sensors for each in recordings}))
        del recordings
        screen.say(f"{len(logs)} drives, {km:.2f} km, decided again with other constants; in {folder}")
        with on_cores(logs, base, flags.jobs) as many:
            trials = Trials(folder, logs, base, many)
            found = _search(trials, base, flags, screen)
            loop = _closed_loop(store, found, folder, flags, screen)
            curves = _sweeps(trials, found, flags, screen)
    taken = found.best.candidate if loop.verdict.taken else found.shipped.candidate
    provenance = Provenance(
        made=datetime.now(UTC).isoformat(timespec="seconds"), code=commit(), command=_command(flags), machine=machine(),
        places=places, drives=kind, km=km, sensors=sensors, optimiser=optimiser(), seed=flags.seed, trials=found.tried,
        objective=files.formula(), before=found.shipped, after=found.best,
        closed_before=loop.before, closed_after=loop.after,
        verdict=f"{'Taken' if loop.verdict.taken else 'The shipped constants stay'}: {loop.verdict.why}.",
    )  # fmt: skip
    _write(folder, taken, found, curves, provenance)
    _tell(folder, taken, found, loop, provenance)
    return int(failed or loop.failed)


def _numbers(flags: argparse.Namespace) -> range:
    return range(1 if flags.quick else flags.runs)


def _seconds(flags: argparse.Namespace) -> float:
    return QUICK_S if flags.quick else 0.0


def _recorded(flags: argparse.Namespace) -> Sequence[RunSpec]:
    settings = {"arbiter": dict(drives.NOBODY_BRAKES)}
    return drives.specs("calibration", _numbers(flags), flags.sensors, _seconds(flags), settings)


def _named(flags: argparse.Namespace, screen: Screen) -> tuple[list[Path], str]:
    """Those of `--from`, and what they are."""
    found = usable(find(flags.logs))
    if found.left_out:
        screen.say(
            f"{found.left_out} drives are left out: the arbiter may have braked in them, or they are of another method"
        )
    return list(found.logs), found.kind


def _drive(store: Store, wanted: Sequence[RunSpec], flags: argparse.Namespace, screen: Screen, what: str) -> bool:
    began_s = time.monotonic()

    def progress(count: int, total: int, place: str) -> None:
        screen.live(f"{what}: {count} of {total} drives; {time_left(count, total, began_s)}; last: {place}")

    problems = drives.driven(store, wanted, flags.jobs, progress)
    screen.end_live()
    for spec in wanted:
        if problem := problems.get(store.key(spec)):
            screen.say(f"{spec.scenario} with the {drives.whose(spec)} constants failed: {problem}")
    return bool(problems)


def _search(trials: Trials, base: Profile, flags: argparse.Namespace, screen: Screen) -> Found:
    began_s, trials_wanted = time.monotonic(), QUICK_TRIALS if flags.quick else flags.trials

    def progress(count: int, best: Trial) -> None:
        total = max(count, trials_wanted + len(ROWS))  # whole generations; then each constant is tried as shipped
        screen.live(f"trial {count} of about {total}: best {best.objective:.3f}; {time_left(count, total, began_s)}")

    found = search(trials, base, trials_wanted, flags.seed, progress)
    screen.end_live()
    return found


def _closed_loop(store: Store, found: Found, folder: Path, flags: argparse.Namespace, screen: Screen) -> _Loop:
    """Shipped and best on the same places, driven."""
    best = found.best.candidate
    if best == found.shipped.candidate:
        return _Loop(None, None, Verdict(False, "the search found nothing better"))
    profile = _candidate_file(folder, best)
    numbers = range(min(1, flags.verify) if flags.quick else flags.verify)
    if not numbers:
        return _Loop(None, None, Verdict(False, "not driven in closed loop (--verify 0)"))
    both = [
        drives.specs("calibration", numbers, flags.sensors, _seconds(flags), settings)
        for settings in ({}, drives.settings_for(best, profile))
    ]
    failed = _drive(store, [*both[0], *both[1]], flags, screen, "closed loop")
    before, after = (closed([kept.metrics for spec in one if (kept := store.kept(store.key(spec)))]) for one in both)
    came_to = verdict(before, after) if before.runs == len(both[0]) else _too_few(before, both[0])
    return _Loop(before, after, came_to, failed)


def _too_few(before: Closed, wanted: Sequence[RunSpec]) -> Verdict:
    return Verdict(False, f"only {before.runs} of {len(wanted)} drives with the shipped constants came to their end")


def _candidate_file(folder: Path, candidate: Candidate) -> Path:
    """A file by its content: closed-loop drives are kept by its name."""
    text = files.profile_text("fitted", candidate, BASE)
    file = folder / "candidates" / f"{hashlib.sha256(text.encode()).hexdigest()[:12]}.toml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def _sweeps(trials: Trials, found: Found, flags: argparse.Namespace, screen: Screen) -> dict[str, Curve]:
    """Each constant over its bounds, the others as fitted."""
    points = {row.name: _points(row.low, row.high, flags.points, found, row.name) for row in ROWS}
    began_s, done, total = time.monotonic(), 0, sum(map(len, points.values()))
    curves: dict[str, Curve] = {}
    for name, values in points.items():
        curve = []
        for value in values:
            curve.append((value, trials.run(found.best.candidate.moved(name, value))))
            done += 1
            screen.live(f"sensitivity: {done} of {total}; {time_left(done, total, began_s)}; {name}")
        curves[name] = curve
    screen.end_live()
    return curves


def _points(low: float, high: float, count: int, found: Found, name: str) -> list[float]:
    known = {found.best.candidate.values[name], found.shipped.candidate.values[name]}
    spread = {float(f"{low + (high - low) * at / (count - 1):.4g}") for at in range(count)}
    return sorted(known | spread)


def _write(folder: Path, taken: Candidate, found: Found, curves: dict[str, Curve], provenance: Provenance) -> None:
    fitted = found.best.candidate
    folder.mkdir(parents=True, exist_ok=True)
    name = "fitted" if taken == fitted and taken != found.shipped.candidate else BASE
    (folder / PROFILE).write_text(files.profile_text(name, taken, BASE, provenance), encoding="utf-8")
    (folder / FITTED).write_text(files.profile_text("fitted", fitted, BASE, provenance), encoding="utf-8")
    (folder / PROVENANCE).write_bytes(msgspec.json.format(msgspec.json.encode(provenance)) + b"\n")
    (folder / PLOT).write_text(
        files.sensitivity_svg(curves, found.shipped.candidate, fitted) if curves else "", encoding="utf-8"
    )


def _tell(folder: Path, taken: Candidate, found: Found, loop: _Loop, provenance: Provenance) -> None:
    """The report in the terminal."""
    before, after = found.shipped, found.best
    say(f"{'':24}{'shipped':>10}{'fitted':>10}   open loop, {provenance.km:.2f} km of {len(provenance.places)} drives")
    say(
        f"{'objective':24}{before.objective:10.3f}{after.objective:10.3f}   {found.tried} trials, {provenance.optimiser}"
    )
    for part in PARTS:
        say(
            f"  {part.name:22}{before.parts[part.name]:10.3f}{after.parts[part.name]:10.3f}   {part.unit}, weight {part.weight:g}"
        )
    moved = [row for row in ROWS if before.candidate.values[row.name] != after.candidate.values[row.name]]
    say(f"constants that moved: {len(moved)} of {len(ROWS)}")
    for row in moved:
        old, new = before.candidate.values[row.name], after.candidate.values[row.name]
        say(f"  {row.name:30}{old:10.4g}{new:10.4g}   {row.unit}, within [{row.low:g}, {row.high:g}]")
    if loop.before is not None and loop.after is not None:
        say(f"closed loop{'':13}{'shipped':>10}{'fitted':>10}")
        for name, value in msgspec.structs.asdict(loop.before).items():
            say(f"  {name:22}{_short(value):>10}{_short(getattr(loop.after, name)):>10}")
    say(provenance.verdict)
    words = [f"--set arbiter.profile={folder / PROFILE}"]
    words += [
        f"--set orchestrator.thresholds.{kind}={value:g}" for kind, value in drives.other_thresholds(taken).items()
    ]
    say(f"drivemcp up {' '.join(words)}")
    say(f"{folder / PLOT}: each constant over its bounds, the others as fitted")


def say(line: str) -> None:
    """A line of the report."""
    sys.stdout.write(line.rstrip() + "\n")


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}" if isinstance(value, float) else str(value)


def _command(flags: argparse.Namespace) -> str:
    words = ["drivemcp", "calibrate", *(["--from", *flags.logs] if flags.logs else [])]
    for name in ("runs", "trials", "seed", "verify", "points", "sensors"):
        words += [f"--{name}", str(getattr(flags, name))]
    return shlex.join([*words, *(["--quick"] if flags.quick else [])])
