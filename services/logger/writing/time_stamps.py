"""Asks an authority for time stamps of heads, on a thread of its own: the log waits for none of them."""

import http.client
import os
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

from proto.health import ChainHead
from services.logger.format import time_stamp
from services.logger.writing.writer import BackgroundThread

MOST_BYTES = 1 << 16
ENDING_S = 2.0
"""How long a logger that ends waits for its last stamp; its supervisor leaves it 6 s for everything."""
AGAIN_S, MOST_AGAIN_S = 5.0, 300.0
"""A stamp that failed is asked for again after so long, then after twice as long each time, and never more seldom than this."""
AT_THE_END_S = 0.5
"""After a failure at the end of the log a stamp is asked for once more, so long after."""


class TimeStamps:
    """A stamp of each file's last head, and one every `every_s` between (0: none), as files beside the log.

    After a failure the newest head of those that want a stamp is asked for again, from `again_s` on ever more seldom, and once more
    at the end. `failed` is told each problem, and an empty text once a stamp has come after one.
    """

    def __init__(
        self,
        url: str,
        directory: Path,
        *,
        every_s: float,
        failed: Callable[[str], None],
        timeout_s: float = 10.0,
        again_s: float = AGAIN_S,
    ) -> None:
        if not url.startswith(("http://", "https://")):
            raise ValueError(f"{url!r} is no http or https address")
        self._url, self._directory, self._every_s, self._timeout_s = url, directory, every_s, timeout_s
        self._failed = failed
        self._asked_s = time.monotonic()
        self._lock, self._pause = threading.Lock(), threading.Event()
        self._open: dict[str, str] = {}
        """By log, the closing head that waits for its stamp."""
        self._owed: tuple[ChainHead, int] | None = None
        """The newest head whose stamp failed."""
        self._again_s, self._wait_s = again_s, again_s
        self._ended = False
        self._thread = BackgroundThread("log-stamps", failed=lambda error: failed(f"no time stamp: {error}"))

    def sealed(self, head: ChainHead, n: int) -> None:
        """A flush is in the file."""
        now_s = time.monotonic()
        waited_s = now_s - self._asked_s
        with self._lock:
            if head.closed:
                self._open[head.file] = head.head_sha256
            owed = self._owed if waited_s >= self._wait_s else None
        if not head.closed:
            if self._thread.behind or not (owed or 0.0 < self._every_s <= waited_s):
                return
            if owed is not None and owed[0].closed:  # the last head of its file: none that comes later stands for it
                head, n = owed
        self._asked_s = now_s
        self._thread.put(lambda: self._stamp(head, n))

    def retired(self, file: str) -> None:
        """Retention deletes a log."""
        for path in self._directory.glob(f"{file}.tsr*"):
            path.unlink(missing_ok=True)
        for path in time_stamp.beside(self._directory / file):
            path.unlink(missing_ok=True)

    def close(self, timeout_s: float = ENDING_S) -> None:
        """Waits for what was asked, and asks once more for what failed; says of which logs the last head has no stamp then."""
        self._thread.put(self._once_more)
        self._thread.close(timeout_s)
        with self._lock:
            left, self._ended = dict(self._open), True
        for file in left:
            self._tell(file, f"no answer when the logger ended, {timeout_s:g} s later")

    def _once_more(self) -> None:
        with self._lock:
            owed = self._owed
        if owed is not None:
            self._pause.wait(min(AT_THE_END_S, self._again_s))
            self._stamp(*owed)

    def _stamp(self, head: ChainHead, n: int) -> None:
        try:
            query, nonce = time_stamp.query(head.head_sha256)
            answer = self._ask(query)
            problem = time_stamp.refusal(answer, head.head_sha256, nonce)
        except (OSError, http.client.HTTPException) as error:
            problem = str(error) or type(error).__name__
        with self._lock:
            if self._ended:
                return  # what is missing was told
            if head.closed:
                self._open.pop(head.file, None)
        try:
            if not problem:
                _write(self._directory / f"{head.file}.{n:08d}{time_stamp.SUFFIX}", answer)
                (self._directory / f"{head.file}{time_stamp.FAILED}").unlink(missing_ok=True)
                self._come(head)
                return
        except OSError as error:
            problem = f"its answer cannot be written: {error.strerror or error}"
        with self._lock:
            if self._owed is not None:
                self._wait_s = min(2.0 * self._wait_s, MOST_AGAIN_S)
            self._owed = head, n
        self._tell(head.file, problem)

    def _come(self, head: ChainHead) -> None:
        """A stamp has come, and the authority answers again; a last head of another file that failed before still wants its own."""
        with self._lock:
            if self._owed is None:
                return
            self._wait_s = self._again_s
            if not self._owed[0].closed or self._owed[0].file == head.file:
                self._owed = None
        self._failed("")

    def _ask(self, query: bytes) -> bytes:
        headers = {"Content-Type": "application/timestamp-query"}
        request = urllib.request.Request(self._url, data=query, headers=headers, method="POST")
        with urllib.request.urlopen(request, timeout=self._timeout_s) as reply:
            answer: bytes = reply.read(MOST_BYTES)
        return answer

    def _tell(self, file: str, problem: str) -> None:
        said = f"no time stamp: {problem}"
        self._failed(said)
        try:
            _write(self._directory / f"{file}{time_stamp.FAILED}", f"{said}\n".encode())
        except OSError as error:
            self._failed(f"{said}; nor can that be written: {error.strerror or error}")


def _write(path: Path, data: bytes) -> None:
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o640), "wb") as file:
        file.write(data)
