"""What the gateway keeps of the bus: the newest world state, the last messages to the driver, the vehicle's degradation."""

from collections import deque
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import msgspec

from domain.hearing import Hearing
from drivemcp.bus.received import Received
from drivemcp.node import Node
from proto import topics
from proto.decision import Advisory
from proto.topics import Topic
from proto.vehicle import Degradation
from proto.world import WorldState
from services.gateway.addresses import ADVICE, HEALTH, WORLD

MOST_MESSAGES = 20
M = TypeVar("M", bound=msgspec.Struct)
Tell = Callable[[str, bool], None]
"""A resource changed, and whether that is urgent."""


class Dated(NamedTuple, Generic[M]):
    """A message with its age, and whether its topic is still alive."""

    message: M
    age_s: float
    fresh: bool


class Seen:
    """The node's thread writes, the server's reads; what is read is swapped whole."""

    def __init__(self, node: Node, tell: Tell) -> None:
        self._node, self._tell = node, tell
        self._hearing = Hearing()
        self._said: deque[Received[Advisory]] = deque(maxlen=MOST_MESSAGES)
        self._degradation: Degradation | None = None
        node.subscribe(topics.WORLD, self._on_world)
        node.subscribe(topics.ADVISORY, self._on_advisory)
        node.subscribe(topics.DEGRADATION, self._on_degradation)

    def world(self) -> Dated[WorldState] | None:
        """The newest state; None before the first."""
        return self._newest(topics.WORLD)

    def messages(self) -> tuple[Dated[Advisory], ...]:
        """What the driver was told, the newest first."""
        return tuple(self._dated(topics.ADVISORY, each) for each in reversed(list(self._said)))

    def tick(self) -> int | None:
        """The newest tick; None before the first."""
        newest = self._newest(topics.ADVISORY)
        return newest.message.tick if newest is not None else None

    def _newest(self, topic: Topic[M]) -> Dated[M] | None:
        received = self._node.latest(topic)
        return self._dated(topic, received) if received is not None else None

    def _dated(self, topic: Topic[Any], received: Received[M]) -> Dated[M]:
        age_s = (self._node.clock.now_ns() - received.stamp_ns) / 1e9
        return Dated(received.message, round(age_s, 3), self._node.health(topic).alive)

    def _on_world(self, message: WorldState, info: Received[WorldState]) -> None:
        self._tell(WORLD, False)

    def _on_advisory(self, message: Advisory, info: Received[Advisory]) -> None:
        if self._hearing.notes(message, info.stamp_ns):
            self._said.append(info)
            self._tell(ADVICE, message.urgency in ("warning", "alarm"))

    def _on_degradation(self, message: Degradation, info: Received[Degradation]) -> None:
        if message != self._degradation:
            self._degradation = message
            self._tell(HEALTH, bool(message.warning_lamps))
