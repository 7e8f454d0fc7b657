"""Asking a slow backend on threads of its own: few at a time, the newest picture first, what is too old not at all."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from services.drivelm.backends.backend import NO_ANSWER, Answer, SlowBackend
from services.drivelm.reading.crops import Picture

T = TypeVar("T")
MOST_WAITING = 32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PendingQuestion(Generic[T]):
    """Pictures of one thing and the question about them. `topic` says which thing: a newer question replaces an older one.

    `images` makes the pictures on the asking thread, so that those of questions that are replaced are never made.
    """

    topic: tuple[object, ...]
    stamp_ns: int
    images: Callable[[], Sequence[Picture]]
    question: str
    subject: T


@dataclass(slots=True)
class _Shelf(Generic[T]):
    waiting: dict[tuple[object, ...], PendingQuestion[T]] = field(default_factory=dict)
    done: list[tuple[PendingQuestion[T], Sequence[Answer]]] = field(default_factory=list)
    newest_ns: int = 0
    closed: bool = False


class BackgroundWorker(Generic[T]):
    """At most `outstanding` questions are with the backend at any time. `ready` is called, on a thread of the runner,
    when there is something to `collect`."""

    def __init__(
        self, backend: SlowBackend, *, outstanding: int, max_age_ns: int, ready: Callable[[], None] = lambda: None
    ) -> None:
        self._backend, self._max_age_ns, self.ready = backend, max_age_ns, ready
        self._shelf, self._changed = _Shelf[T](), threading.Condition()
        self.log = logging.getLogger("drivemcp.drivelm")
        for number in range(outstanding):
            threading.Thread(target=self._work, name=f"drivelm-worker-{number}", daemon=True).start()

    def send(self, pending: PendingQuestion[T]) -> None:
        """Leave a question to be asked; returns at once. Of one thing only the newest waits, of all the newest `MOST_WAITING`."""
        with self._changed:
            waiting, shelf = self._shelf.waiting, self._shelf
            waiting.pop(pending.topic, None)
            waiting[pending.topic] = pending
            shelf.newest_ns = max(shelf.newest_ns, pending.stamp_ns)
            if len(waiting) > MOST_WAITING:
                del waiting[min(waiting.values(), key=lambda each: each.stamp_ns).topic]
            self._changed.notify()

    def collect(self) -> list[tuple[PendingQuestion[T], Sequence[Answer]]]:
        """What was answered since the last call, oldest picture first; at least one answer each, if only an abstention."""
        with self._changed:
            done, self._shelf.done = self._shelf.done, []
        return sorted(done, key=lambda row: row[0].stamp_ns)

    def close(self) -> None:
        """Begin nothing new. What is being asked ends by itself, unheard."""
        with self._changed:
            self._shelf.closed = True
            self._shelf.waiting.clear()
            self._changed.notify_all()

    def _work(self) -> None:
        while (pending := self._next()) is not None:
            answers = self._asked(pending)
            with self._changed:
                if self._shelf.closed:
                    return
                self._shelf.done.append((pending, answers))
            self.ready()

    def _next(self) -> PendingQuestion[T] | None:
        with self._changed:
            self._drop_old()
            while not self._shelf.waiting and not self._shelf.closed:
                self._changed.wait()
                self._drop_old()
            if self._shelf.closed:
                return None
            newest = max(self._shelf.waiting.values(), key=lambda each: each.stamp_ns)  # the first of one picture
            return self._shelf.waiting.pop(newest.topic)

    def _drop_old(self) -> None:
        oldest_ns = self._shelf.newest_ns - self._max_age_ns
        old = [topic for topic, each in self._shelf.waiting.items() if each.stamp_ns < oldest_ns]
        for topic in old:
            del self._shelf.waiting[topic]

    def _asked(self, pending: PendingQuestion[T]) -> Sequence[Answer]:
        images: Sequence[Picture] = ()
        answers: Sequence[Answer] = ()
        try:
            images = pending.images()
            answers = self._backend.answer(images, pending.question) if images else ()
        except Exception:  # the runner of foreign code: one bad answer must not end the thread
            self.log.exception("%s: asking failed", self._backend.name)
        if answers and len(answers) == len(images):
            return answers
        return [NO_ANSWER]
