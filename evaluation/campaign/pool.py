"""Runs side by side: a process a slot, each driving one run after another. A run that crashes or sticks is told of."""

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from drivemcp.errors import DriveMcpError
from evaluation.run.spec import RunSpec

RUNS_A_PROCESS = 20
"""Then the slot starts a fresh one."""
GRACE_S = 3.0
START_S = 120.0
SLOWEST = 60.0
"""A run may take so many times its simulated duration; a step that hangs is noticed by the run itself."""
LONGEST_S = 900.0
"""Of a run without a set duration."""
TAKEN = 0
"""What a process says that has a job; at the job's end it says what went wrong."""


class Job(NamedTuple):
    """A run to be driven, by its key."""

    key: str
    spec: RunSpec


class Done(NamedTuple):
    """A run's end: what it came to, or what went wrong."""

    key: str
    problem: str
    wall_s: float


Work = Callable[[str, str, RunSpec], object]
"""folder, key, spec; `run_one` but in tests."""


def allowed_s(spec: RunSpec) -> float:
    """The wall time after which a run counts as stuck."""
    return START_S + SLOWEST * (spec.seconds or LONGEST_S)


@dataclass(slots=True)
class _Slot:
    """One process, and the job it is at."""

    process: Any = None
    pipe: Connection | None = None
    job: Job | None = None
    started_s: float = 0.0
    runs: int = 0
    taken: bool = False
    """Whether the process has said that it has the job."""


@dataclass(slots=True)
class Pool:
    """`done` drives jobs and yields their ends as they come. Leaving the generator ends all processes."""

    folder: str
    jobs: int
    work: Work
    allowed: Callable[[RunSpec], float] = allowed_s
    _slots: list[_Slot] = field(default_factory=list)
    _waiting: deque[Job] = field(default_factory=deque)

    def done(self, jobs: Sequence[Job]) -> Iterator[Done]:
        """Each job's end, in the order in which they end."""
        self._waiting = deque(jobs)
        self._slots = [_Slot() for _ in range(min(self.jobs, len(self._waiting)))]
        try:
            while self._waiting or any(slot.job for slot in self._slots):
                for slot in self._slots:
                    if slot.job is None and self._waiting:
                        self._give(slot, self._waiting.popleft())
                yield from self._ended()
        finally:
            for slot in self._slots:
                _end(slot)

    def _give(self, slot: _Slot, job: Job) -> None:
        if slot.runs >= RUNS_A_PROCESS:
            _end(slot)
        if slot.pipe is None or not self._sent(slot, job):
            _end(slot)  # it may have died since its last run
            self._start(slot)
            self._sent(slot, job)
        slot.job, slot.started_s, slot.taken = job, time.monotonic(), False
        slot.runs += 1

    def _sent(self, slot: _Slot, job: Job) -> bool:
        """Whether a process takes the job. A process that is just dying seems to take it, and never says that it has it."""
        assert slot.pipe is not None
        try:
            slot.pipe.send((self.folder, job.key, job.spec))
        except OSError:
            return False
        return True

    def _start(self, slot: _Slot) -> None:
        context = multiprocessing.get_context("spawn")
        slot.pipe, theirs = context.Pipe()
        slot.process = context.Process(target=_serve, args=(theirs, self.work))
        slot.process.start()
        theirs.close()
        slot.runs = 0

    def _ended(self) -> Iterator[Done]:
        busy = {slot.pipe: slot for slot in self._slots if slot.job is not None and slot.pipe is not None}
        ready = wait(list(busy), timeout=0.5)
        for pipe, slot in busy.items():
            if slot.job is None:
                continue
            took_s = time.monotonic() - slot.started_s
            if pipe in ready:
                job, problem = slot.job, self._answer(slot)
                if problem is not None:
                    yield Done(job.key, problem, took_s)
            elif took_s > self.allowed(slot.job.spec):
                job = slot.job
                _end(slot)
                yield Done(job.key, f"stuck: not done after {took_s:.0f} s", took_s)

    def _answer(self, slot: _Slot) -> str | None:
        """What went wrong, from the process or about it; empty: nothing. The slot is free then. None: no run has ended."""
        assert slot.pipe is not None
        assert slot.job is not None
        try:
            told = slot.pipe.recv()
        except (EOFError, OSError):
            slot.process.join(GRACE_S)
            job, told = slot.job, f"its process ended with {slot.process.exitcode}"
            died_before = slot.runs > 1 and not slot.taken
            _end(slot)
            if died_before:  # of its last run; this one it never began
                self._waiting.appendleft(job)
                return None
        if told == TAKEN:
            slot.taken = True
            return None
        slot.job = None
        return str(told)


def _end(slot: _Slot) -> None:
    """End the slot's process and what it started; they are one process group."""
    if slot.pipe is not None:
        slot.pipe.close()
    if slot.process is not None:
        if slot.job is None:
            slot.process.join(GRACE_S)
        for number in (signal.SIGTERM, signal.SIGKILL):
            if slot.process.is_alive():
                _signal(slot.process.pid, number)
                slot.process.join(GRACE_S)
        with suppress(ProcessLookupError):  # as a rule no process of the group is left
            os.killpg(slot.process.pid, signal.SIGKILL)
    slot.process, slot.pipe, slot.job = None, None, None


def _signal(pid: int, number: signal.Signals) -> None:
    try:
        os.killpg(pid, number)
    except ProcessLookupError:  # not yet the leader of its group
        os.kill(pid, number)


def _serve(pipe: Connection, work: Work) -> None:
    """The process of a slot: one job after another until the pipe closes."""
    os.setsid()  # Ctrl-C is for the parent, which ends us
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGTERM, lambda *_: os._exit(143))
    while True:
        try:
            folder, key, spec = pipe.recv()
        except EOFError:
            return
        pipe.send(TAKEN)
        _write_to(Path(folder))
        pipe.send(tried(work, folder, key, spec))


def _end_with_parent() -> None:
    """End this process group once the parent has ended.

    A parent that was killed ends no process, and no process may go on driving into a folder that the next parent takes.
    """
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.killpg(os.getpid(), signal.SIGKILL)


def _write_to(folder: Path) -> None:
    """What services say goes to a file of the slot, so that it does not run through the progress."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"slot-{os.getpid()}.log").open("ab") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)


def tried(work: Work, folder: str, key: str, spec: RunSpec) -> str:
    """Do the work; what went wrong, or nothing."""
    try:
        work(folder, key, spec)
    except DriveMcpError as error:
        return f"{type(error).__name__}: {error}"
    except Exception:  # noqa: BLE001  one run's bug is that run's result; the others go on
        return traceback.format_exc()
    return ""
