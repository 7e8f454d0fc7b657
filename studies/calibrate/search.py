"""The search: CMA-ES over the bounds, each trial every recorded drive decided again. What was tried is kept, and not tried twice."""

import hashlib
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import msgspec

from drivemcp.errors import MALFORMED, UserError
from evaluation.campaign.store import MEASURES
from evaluation.metrics.record import TRUTH_FILE
from evaluation.run.behaviour import behaviour
from services.arbiter.profiles.profile import Profile
from studies.calibrate import again, bench
from studies.calibrate.constants import ROWS, Candidate, scaled, shipped, unfit, unscaled
from studies.calibrate.recordings import Recording, load
from studies.calibrate.score import UNFIT, Counts, counts, objective, parts, pooled

STEP = 0.15
"""First spread of the search, as a share of the bounds."""
STAYS = 0.02
"""A constant whose shipped value costs no more than this share of the gain keeps it: no evidence, no change."""
TRIALS = "trials.jsonl"
Many = Callable[[Candidate], list[Counts]]


class Trial(msgspec.Struct, frozen=True, kw_only=True):
    """A candidate and what it came to."""

    candidate: Candidate
    objective: float
    parts: dict[str, float] = {}
    refused: str = ""
    """Why the design refuses it; then nothing was decided again."""


class Kept(msgspec.Struct, frozen=True, kw_only=True):
    """A line of the file of trials."""

    key: str
    trial: Trial


class Found(NamedTuple):
    """The shipped constants' trial, and the best."""

    shipped: Trial
    best: Trial
    tried: int


class Trials:
    """Tries candidates, each once: results lie in a file, by the drives, the code and the values."""

    def __init__(self, folder: Path, logs: Sequence[Path], base: Profile, many: Many) -> None:
        self._file, self._base, self._many = folder / TRIALS, base, many
        self._told = _digest(logs, base)
        self._known = {kept.key: kept.trial for kept in self._lines()}

    def run(self, candidate: Candidate) -> Trial:
        """What the candidate comes to."""
        key = hashlib.sha256(self._told + msgspec.json.encode(candidate, order="deterministic")).hexdigest()[:16]
        if key not in self._known:
            self._known[key] = trial = self._tried(candidate)
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with self._file.open("ab") as file:
                file.write(msgspec.json.encode(Kept(key=key, trial=trial)) + b"\n")
        return self._known[key]

    def _tried(self, candidate: Candidate) -> Trial:
        if refused := unfit(candidate, self._base):
            return Trial(candidate=candidate, objective=UNFIT, refused=refused)
        found = parts(pooled(self._many(candidate)), bench.mean_impact_mps(candidate.profile(self._base)))
        return Trial(candidate=candidate, objective=objective(found), parts=found)

    def _lines(self) -> Iterator[Kept]:
        try:
            lines = self._file.read_bytes().splitlines()
        except OSError:
            return
        for line in lines:
            try:
                yield msgspec.json.decode(line, type=Kept)
            except MALFORMED:
                continue  # cut off while it was written: tried again


SCORING = "1"
"""Raise it when a trial is scored otherwise: trials that were kept are then made again."""


def _digest(logs: Sequence[Path], base: Profile) -> bytes:
    """Of all that a trial's result depends on but the candidate."""
    digest = hashlib.sha256(f"{behaviour()} {MEASURES} {SCORING}".encode())
    digest.update(base.sha256.encode())
    for log in logs:
        for file in (log, log.parent / TRUTH_FILE):
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.digest()


def search(trials: Trials, base: Profile, count: int, seed: int, progress: Callable[[int, Trial], None]) -> Found:
    """CMA-ES from the shipped constants; then each constant goes back to its shipped value if that costs nothing."""
    first = best = trials.run(shipped(base))
    progress(1, best)
    strategy, tried = _strategy(scaled(first.candidate), seed), 1
    while tried < count:
        places = strategy.ask()
        told = []
        for place in places:
            trial = trials.run(unscaled(place))
            tried += 1
            told.append(trial.objective)
            best = min(best, trial, key=lambda each: each.objective)
            progress(tried, best)
        strategy.tell(places, told)
    best = _put_back(trials, first, best, lambda done, trial: progress(tried + done, trial))
    return Found(first, best, tried)


def _put_back(trials: Trials, first: Trial, best: Trial, progress: Callable[[int, Trial], None]) -> Trial:
    allowed = STAYS * (first.objective - best.objective)
    for done, row in enumerate(ROWS, 1):
        before = first.candidate.values[row.name]
        if best.candidate.values[row.name] == before:
            continue
        trial = trials.run(best.candidate.moved(row.name, before))
        if trial.objective <= best.objective + allowed:
            best = trial
        progress(done, best)
    return best


def _strategy(start: list[float], seed: int):  # type: ignore[no-untyped-def]
    try:
        import cma
    except ModuleNotFoundError as error:
        raise UserError("the optimiser is missing: pip install 'drivemcp[calibrate]'") from error
    return cma.CMAEvolutionStrategy(start, STEP, {"bounds": [0.0, 1.0], "seed": seed, "verbose": -9})


def optimiser() -> str:
    """Name and version."""
    from importlib.metadata import version

    return f"CMA-ES (cma {version('cma')})"


# -- all drives, on all cores ------------------------------------------------------------------------------------------


@contextmanager
def on_cores(logs: Sequence[Path], base: Profile, jobs: int) -> Iterator[Many]:
    """A function that decides all drives again; with more than one job each process has its share of them."""
    jobs = min(jobs, len(logs))
    if jobs <= 1:
        drives = [load(log) for log in logs]
        yield lambda candidate: _counted(drives, candidate, base)
        return
    context = multiprocessing.get_context("spawn")
    pipes: list[Connection] = []
    workers = []
    try:
        for number in range(jobs):
            ours, theirs = context.Pipe()
            worker = context.Process(target=_serve, args=(theirs, list(logs[number::jobs]), base), daemon=True)
            worker.start()
            theirs.close()
            pipes.append(ours)
            workers.append(worker)
        yield lambda candidate: _asked(pipes, candidate)
    finally:
        for pipe in pipes:
            pipe.close()
        for worker in workers:
            worker.join(3.0)
            if worker.is_alive():
                worker.terminate()
                worker.join(3.0)


def _asked(pipes: Sequence[Connection], candidate: Candidate) -> list[Counts]:
    for pipe in pipes:
        pipe.send(candidate.values)
    found: list[Counts] = []
    for pipe in pipes:
        answer = pipe.recv()
        if isinstance(answer, str):
            raise UserError(answer)
        found += answer
    return found


def _counted(drives: Sequence[Recording], candidate: Candidate, base: Profile) -> list[Counts]:
    return [counts(again.again(drive, candidate, base)) for drive in drives]


def _serve(pipe: Connection, logs: list[Path], base: Profile) -> None:
    """A worker: its drives are loaded once, then each candidate is tried on them."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, whose end closes the pipe
    drives: list[Recording] = []
    problem = ""
    try:
        drives = [load(log) for log in logs]
    except UserError as error:
        problem = str(error)
    while True:
        try:
            values = pipe.recv()
            pipe.send(problem or _counted(drives, Candidate(values=values), base))
        except (EOFError, OSError):
            return
