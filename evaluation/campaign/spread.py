"""Runs spread over machines by Ray: the same work, one task a run. Each machine needs the same code and sees the same folder."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from drivemcp.errors import UserError
from evaluation.campaign.pool import Done, Job, Work, allowed_s, tried
from evaluation.run.spec import RunSpec

STUCK = 124
"""A process's exit status, as of the command timeout."""


@dataclass(frozen=True, slots=True)
class Spread:
    """`done` as the pool's. `address`: of a Ray cluster; `local` starts one here."""

    folder: str
    address: str
    work: Work
    allowed: Callable[[RunSpec], float] = allowed_s

    def done(self, jobs: Sequence[Job]) -> Iterator[Done]:
        """Each job's end, in the order in which they end. Raises UserError without Ray, or where no cluster answers."""
        if not jobs:
            return
        ray = _ray()
        _connect(ray, self.address)
        try:
            # One run for one process, which then ends: what a run leaves behind never meets another run
            task = ray.remote(num_cpus=1, max_retries=0, max_calls=1)(_work)
            running = {task.remote(self.work, self.folder, *job, self.allowed(job.spec)): job for job in jobs}
            while running:
                (ended, *_), _ = ray.wait(list(running), num_returns=1)
                yield self._end(ray, ended, running.pop(ended))
        finally:
            ray.shutdown()

    def _end(self, ray: Any, ended: Any, job: Job) -> Done:
        try:
            problem, wall_s = ray.get(ended)
        except ray.exceptions.RayError as error:
            stuck = f"a run that is stuck is ended after {self.allowed(job.spec):.0f} s"
            return Done(job.key, f"its process ended ({stuck}): {error}", 0.0)
        return Done(job.key, problem, wall_s)


def _work(work: Work, folder: str, key: str, spec: RunSpec, seconds: float) -> tuple[str, float]:
    """The run in its process of the cluster, which ends itself where the run is stuck."""
    started_s = time.monotonic()
    stuck = threading.Timer(seconds, os._exit, (STUCK,))
    stuck.daemon = True
    stuck.start()
    return tried(work, folder, key, spec), time.monotonic() - started_s


def _ray() -> Any:
    try:
        import ray
    except ImportError as error:
        raise UserError("Ray is missing; install the extra: pip install 'drivemcp[ray]'") from error
    return ray


def _connect(ray: Any, address: str) -> None:
    try:
        ray.init(address=address, log_to_driver=False, include_dashboard=False, logging_level="warning")
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise UserError(f"no Ray cluster at {address!r}: {error}") from error
