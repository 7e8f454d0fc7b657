"""A thread for what may take its time: fsync and the database. The log's writer never waits for it."""

import queue
import threading
from collections.abc import Callable


class Aside:
    """Runs jobs one after the other. What a job raises is told to `failed`; the next one runs all the same."""

    def __init__(self, name: str, *, failed: Callable[[Exception], None]) -> None:
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._failed = failed
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, job: Callable[[], None]) -> None:
        """Runs it later."""
        self._jobs.put(job)

    @property
    def behind(self) -> int:
        """How many jobs wait."""
        return self._jobs.qsize()

    def close(self, timeout_s: float) -> bool:
        """Runs what waits; whether that was done in time."""
        self._jobs.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except Exception as error:  # noqa: BLE001 whatever one job raises, the later ones are still to be run
                self._failed(error)
