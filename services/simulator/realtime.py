"""Driving by the wall clock: steps are computed ahead, pictures drawn ahead, and everything leaves at its instant.

Simulated time is wall time since the start. What is late is dropped and counted; time never slows. Where the drive was stopped,
or the clock was set, it goes on at the present: the world has stood still meanwhile.
"""

import heapq
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import msgspec

from proto import topics
from proto.sensors import CameraFrame, CanFrame, CanFrames
from proto.truth import ScenarioState
from services.simulator.sensors.camera_process import Order, Studio
from services.simulator.session import CAMERAS, Batch, Outgoing, Session, Shot

MOST_ORDERS = 6
MOST_BEHIND_NS = 1_000_000_000
"""A drive that is later than this, or that much too early, goes on at the present. Step by step it might never get there: all that
its sensors see meanwhile is too old to be sent."""
LONGEST_LATE_S = 2.0
"""Also one that is late by less, but for so long that its sensors are missed."""
_KEPT_IF_STALE = frozenset({topics.CLOCK.name, topics.TRUTH.name, topics.SCENARIO.name, topics.CAN_RX.name})
Publish = Callable[[Outgoing, int], None]


@dataclass(order=True, slots=True)
class _Due:
    """Something that leaves at an instant."""

    at_ns: int
    number: int
    what: Outgoing | Shot = field(compare=False)


class RealTime:
    """A thread that drives one session. `publish(message, stamp_ns)` must not block.

    `ahead_ns`: how much earlier than its instant a step is computed. `stale_ns`: sensors whose instant is longer past than
    this are dropped; only state goes out late.
    """

    def __init__(
        self,
        session: Session,
        studio: Studio | None,
        publish: Publish,
        now_ns: Callable[[], int],
        *,
        ahead_ns: int,
        stale_ns: int,
    ) -> None:
        self._ahead_ns, self._stale_ns = ahead_ns, stale_ns
        self.session, self._studio, self._publish, self._now_ns = session, studio, publish, now_ns
        self._due: list[_Due] = []
        self._numbers, self._wake, self._stop = 0, threading.Event(), threading.Event()
        self._lock = threading.Lock()
        self._mail: list[Callable[[], None]] = []
        self._thread = threading.Thread(target=self._drive, name="simulator-drive", daemon=True)
        self.skipped_s = 0.0
        """How much time the drive has passed over to come back to the present."""
        self._late_since_s: float | None = None
        self.completed = False
        """Whether it came to its end or was stopped; a thread that ended otherwise broke off."""

    def start(self) -> None:
        """Begin; the session's epoch is the wall's present."""
        self.session.epoch_ns = self._now_ns() + self._ahead_ns
        self._thread.start()

    def stop(self) -> None:
        """End and wait for the end."""
        self._stop.set()
        self._wake.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(5.0)

    @property
    def alive(self) -> bool:
        """Whether it still drives."""
        return self._thread.is_alive()

    def deliver(self, job: Callable[[], None]) -> None:
        """Let something reach the session (advice, brakes) on the driving thread."""
        with self._lock:
            self._mail.append(job)
        self._wake.set()

    def request(self, frames: Sequence[CanFrame]) -> None:
        """Frames sent on the car's bus."""
        self.deliver(lambda: self._answer(frames))

    def _drive(self) -> None:
        while not self._stop.is_set() and not (self.session.finished and not self._due):
            self._handle_mail()
            self._keep_to_the_present()
            self._send_due()
            if not self.session.finished and self.session.next_stamp_ns - self._ahead_ns <= self._now_ns():
                self._take_in(self.session.advance(self._ahead_ns / 1e9))
            else:
                self._sleep()
        self.completed = True

    def _keep_to_the_present(self) -> None:
        """Pass over the time of a stop or of a clock that was set, instead of driving through it."""
        if self.session.finished:
            return
        behind_ns = self._now_ns() - (self.session.next_stamp_ns - self._ahead_ns)
        if behind_ns <= self._ahead_ns + self._stale_ns:
            self._late_since_s = None
        elif self._late_since_s is None:
            self._late_since_s = time.monotonic()
        late_s = time.monotonic() - self._late_since_s if self._late_since_s is not None else 0.0
        if abs(behind_ns) > MOST_BEHIND_NS or late_s > LONGEST_LATE_S:
            self._pass_over(behind_ns)

    def _pass_over(self, by_ns: int) -> None:
        self._late_since_s = None
        self.skipped_s += by_ns / 1e9
        self.session.epoch_ns += by_ns
        for due in self._due:
            if isinstance(due.what, Shot):
                self.session.late_frames += 1
                if self._studio is not None:
                    self._studio.forget(due.number)
        self._due.clear()

    def _sleep(self) -> None:
        next_step = self.session.next_stamp_ns - self._ahead_ns if not self.session.finished else None
        wakes = [at for at in (next_step, self._due[0].at_ns if self._due else None) if at is not None]
        wait_s = (min(wakes) - self._now_ns()) / 1e9 if wakes else 0.0
        if wait_s > 0.0:
            self._wake.wait(min(wait_s, 0.2))
        self._wake.clear()

    def _handle_mail(self) -> None:
        with self._lock:
            mail, self._mail = self._mail, []
        for job in mail:
            job()

    def _answer(self, frames: Sequence[CanFrame]) -> None:
        now_ns = self._now_ns()
        answers = self.session.request(frames, now_ns)
        if answers:
            stamped = tuple(msgspec.structs.replace(frame, stamp_ns=frame.stamp_ns or now_ns) for frame in answers)
            self._publish(Outgoing(topics.CAN_RX, CanFrames(frames=stamped), self.session.bus), now_ns)

    # What leaves when ---------------------------------------------------------------------------------------------------

    def _take_in(self, batch: Batch) -> None:
        for shot in batch.shots:  # before the messages of the instant, so that the state counts a picture that is late
            number = self._put(batch.stamp_ns, shot)
            if self._studio is None or self._studio.waiting >= MOST_ORDERS:
                continue  # it is not drawn: it will be missing at its instant, and counted
            self._studio.order(Order(number, shot.camera, shot.scene, batch.stamp_ns))
        for message in batch.messages:
            self._put(batch.stamp_ns, message)

    def _put(self, at_ns: int, what: Outgoing | Shot) -> int:
        self._numbers += 1
        heapq.heappush(self._due, _Due(at_ns, self._numbers, what))
        return self._numbers

    def _send_due(self) -> None:
        while self._due and self._due[0].at_ns <= self._now_ns():
            due = heapq.heappop(self._due)
            if isinstance(due.what, Shot):
                self._send_picture(due.what, due)
            elif self._now_ns() - due.at_ns < self._stale_ns or due.what.topic.name in _KEPT_IF_STALE:
                self._publish(self._up_to_date(due.what), due.at_ns)

    def _up_to_date(self, out: Outgoing) -> Outgoing:
        if not isinstance(out.message, ScenarioState):
            return out
        state = msgspec.structs.replace(out.message, late_frames=self.session.late_frames)
        return Outgoing(out.topic, state, out.id)

    def _send_picture(self, shot: Shot, due: _Due) -> None:
        picture = self._studio.take(due.number) if self._studio is not None else None
        if picture is None or not picture.jpeg or self._now_ns() - due.at_ns > self._stale_ns:
            self.session.late_frames += 1
            if self._studio is not None:
                self._studio.forget(due.number)
            return
        self._publish(frame_message(shot, picture.jpeg), due.at_ns)


def frame_message(shot: Shot, jpeg: bytes) -> Outgoing:
    """A picture as a message."""
    camera = CAMERAS[shot.camera]
    frame = CameraFrame(jpeg=jpeg, width_px=camera.width_px, height_px=camera.height_px, frame=shot.frame)
    return Outgoing(topics.CAMERA, frame, shot.camera)
