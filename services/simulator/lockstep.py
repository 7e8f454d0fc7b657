"""Driving in lockstep: a step, its pictures, then every other service's turn; nothing waits for a wall clock."""

from collections.abc import Callable

from services.simulator.realtime import Publish, frame_message
from services.simulator.sensors.camera_process import Order, Studio, StudioError
from services.simulator.session import Batch, Session

EPOCH_NS = 1_000_000_000_000
"""The stamp of time zero in lockstep: the same in every run."""
PICTURE_BOUND_S = 30.0


class Conductor:
    """Drives one session step by step. `conduct(now_ns)` returns when all others have done their step."""

    def __init__(
        self, session: Session, studio: Studio | None, publish: Publish, conduct: Callable[[int], None]
    ) -> None:
        self.session, self._studio, self._publish, self._conduct = session, studio, publish, conduct
        self._numbers = 0

    def step(self) -> bool:
        """One step of all; whether there is another. Raises StudioError and whatever `conduct` raises."""
        batch = self.session.advance()
        for message in batch.messages:
            self._publish(message, batch.stamp_ns)
        self._pictures(batch)
        self._conduct(batch.stamp_ns)
        return not self.session.finished

    def _pictures(self, batch: Batch) -> None:
        for shot in batch.shots:
            if self._studio is None:
                continue
            self._numbers += 1
            self._studio.order(Order(self._numbers, shot.camera, shot.scene))
            picture = self._studio.take(self._numbers, PICTURE_BOUND_S)
            if picture is None or not picture.jpeg:
                raise StudioError(picture.trouble if picture else f"no picture within {PICTURE_BOUND_S:.0f} s")
            self._publish(frame_message(shot, picture.jpeg), batch.stamp_ns)
