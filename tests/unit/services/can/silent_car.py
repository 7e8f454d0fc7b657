"""A simulated car of which messages fall silent, and what its vehicle makes of that."""

from collections.abc import Callable, Collection
from pathlib import Path

import msgspec

from proto.vehicle import Degradation
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile
from services.can.vehicle import Vehicle
from services.simulator.car.state import CarModel, CarState, Controls
from services.simulator.ecus.can_frames import FrameEncoder

NS = 1_000_000_000
STEP_S = 0.02
Shown = Callable[[CarState], CarState]


def as_it_is(state: CarState) -> CarState:
    return state


class SilentCar:
    """Steps the car; frames of `silent` messages are lost, those of `ahead` are stamped so many seconds ahead."""

    def __init__(self, dbc: Dbc, dbc_path: Path, profile: Profile, book: DtcBook) -> None:
        self.vehicle = Vehicle({"can0": dbc}, profile, book, lambda arbitration_id, payload: None)
        self._encoder, self._model = FrameEncoder(dbc_path), CarModel()
        self._names = {message.frame_id: message.name for message in dbc.messages.values()}
        self.now_ns = 1000 * NS

    @property
    def messages(self) -> list[str]:
        return sorted(self._names.values())

    def drive(
        self,
        seconds: float,
        controls: Controls,
        *,
        shown: Shown = as_it_is,
        silent: Collection[str] = (),
        ahead: dict[str, float] | None = None,
    ) -> Degradation:
        """The health after so long; it is assessed twice a second."""
        steps = round(seconds / STEP_S)
        for step in range(1, steps + 1):
            self.now_ns += round(STEP_S * NS)
            due = self._encoder.due(shown(self._model.step(STEP_S, controls)), self.now_ns)
            frames = [each for each in due if self._names[each.arbitration_id] not in silent]
            self.vehicle.ingest(
                [
                    msgspec.structs.replace(each, stamp_ns=each.stamp_ns + round(later * NS))
                    for each in frames
                    for later in ((ahead or {}).get(self._names[each.arbitration_id], 0.0),)
                ],
                self.now_ns,
            )
            if step % 25 == 0 or step == steps:
                self.vehicle.degradation(self.now_ns)
        return self.vehicle.assessment.degradation
