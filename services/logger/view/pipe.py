"""The logger's end of the live view: starts its process and hands it records, thinned, and dropped when it is behind."""

import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import IO

import msgspec

from drivemcp.errors import MALFORMED
from proto import topics
from services.logger.view.settings import Said, Shown, ViewSettings
from services.logger.writing.log_file import Record

QUEUE = 400
"""Records that wait at most; the oldest go first. About two seconds of a drive."""
SHOWN_TOPICS = frozenset(
    topic.name
    for topic in (
        topics.CAMERA, topics.BOXES, topics.FACTS, topics.TRACKS, topics.LANES, topics.EGO, topics.ADVISORY,
        topics.DECISION, topics.CALLS,
    )
)  # fmt: skip


class Thinning:
    """Lets through at most `rate_hz` of a name, by the records' own stamps. Pure but for what it remembers."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = int(1e9 / rate_hz) if rate_hz > 0 else 0
        self._next_ns: dict[str, int] = {}

    def passes(self, name: str, stamp_ns: int) -> bool:
        """Whether this one is shown."""
        due_ns = self._next_ns.get(name, stamp_ns)
        if stamp_ns < due_ns:
            return False
        behind = stamp_ns - due_ns
        self._next_ns[name] = stamp_ns + self._period_ns - min(behind, self._period_ns // 2)
        return True


class ViewPipe:
    """Never blocks and never raises in `offer`: a view that dies or lags costs the log nothing."""

    def __init__(self, settings: ViewSettings, *, said: Callable[[Said], None]) -> None:
        self._said = said
        self._pictures = Thinning(settings.image_hz)
        self._queue: deque[bytes] = deque()
        self._ready = threading.Condition()
        self._closed = self._ending = False
        self.dropped = 0
        self._process = subprocess.Popen(
            [sys.executable, "-m", "services.logger.view", msgspec.json.encode(settings).decode()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._writer = threading.Thread(target=self._write, args=(self._process.stdin,), name="view-pipe", daemon=True)
        self._listener = threading.Thread(
            target=self._listen, args=(self._process.stdout,), name="view-said", daemon=True
        )
        self._writer.start()
        self._listener.start()

    def offer(self, topic: str, record: Record) -> None:
        """Shows a record, if it is one that is shown and the view keeps up."""
        if topic not in SHOWN_TOPICS:
            return
        if topic == topics.CAMERA.name and not self._pictures.passes(record.topic, record.publish_time_ns):
            return
        self.send(Shown(topic=topic, name=record.topic, stamp_ns=record.publish_time_ns, data=record.data))

    def send(self, shown: Shown, *, wait: bool = False) -> None:
        """Queues one; with `wait` (an old file) holds back the caller instead of dropping."""
        packed = msgspec.msgpack.encode(shown)
        with self._ready:
            if wait:
                self._ready.wait_for(lambda: len(self._queue) < QUEUE or self._closed, timeout=30.0)
            elif len(self._queue) >= QUEUE:
                self._queue.popleft()
                self.dropped += 1
            self._queue.append(len(packed).to_bytes(4, "little") + packed)
            self._ready.notify_all()

    def close(self, timeout_s: float = 4.0, *, drain: bool = False) -> None:
        """Ends the view's process. `drain`: what still waits is shown first."""
        self._ending = True
        with self._ready:
            if drain:
                self._ready.wait_for(lambda: not self._queue or self._closed, timeout=timeout_s)
            self._closed = True
            self._ready.notify_all()
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(timeout_s)
        self._writer.join(timeout_s)
        self._listener.join(timeout_s)

    def wait_ended(self) -> int:
        """Until the view's process ends by itself; its exit status."""
        return self._process.wait()

    def _write(self, pipe: IO[bytes]) -> None:
        with suppress(OSError):  # the view is gone; `_listen` tells
            while (packed := self._take()) is not None:
                pipe.write(packed)
                pipe.flush()
        with self._ready:
            self._closed = True
            self._ready.notify_all()
        with suppress(OSError):
            pipe.close()

    def _take(self) -> bytes | None:
        with self._ready:
            self._ready.wait_for(lambda: self._queue or self._closed)
            if self._closed:
                return None
            packed = self._queue.popleft()
            self._ready.notify_all()
            return packed

    def _listen(self, pipe: IO[bytes]) -> None:
        with pipe:
            for line in pipe:
                try:
                    self._said(msgspec.json.decode(line, type=Said))
                except MALFORMED:
                    continue  # a library's own words on standard output
        if not self._ending:
            self._said(Said(problem=f"the view ended by itself (status {self._process.wait()})"))
