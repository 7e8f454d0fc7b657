"""A service some of whose publications are replaced as they leave. It is the one of production, and knows nothing of it."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Protocol, cast

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from evaluation.stand_ins.facts import TrueFacts
from evaluation.stand_ins.kinds import StandIn
from evaluation.stand_ins.tracks import TrueTracks
from proto import topics
from proto.topics import Topic
from proto.truth import Truth
from proto.vehicle import Degradation

SOUND = Degradation(h=0.0, brake_envelope=1.0)


class Replacement(Protocol):
    """What is published instead of one topic's messages."""

    @property
    def topic(self) -> Topic[Any]:
        """Whose messages it replaces."""

    def truth(self, truth: Truth, stamp_ns: int) -> Any:
        """What is so at a stamp; a message to publish now, or None."""

    def instead(self, message: Any, stamp_ns: int) -> Any:
        """What leaves in place of a message; None: nothing."""


class SoundCar:
    """A car that says that nothing ails it."""

    topic = topics.DEGRADATION

    def truth(self, truth: Truth, stamp_ns: int) -> None:
        """Not looked at."""

    def instead(self, message: Degradation, stamp_ns: int) -> Degradation:
        """Always the same."""
        return SOUND


TABLE: Mapping[tuple[StandIn, str], Callable[[], Replacement]] = MappingProxyType(
    {("truth", "perception"): TrueTracks, ("truth", "drivelm"): TrueFacts, ("sound_car", "can"): SoundCar}
)
"""Stand-in and service to what is replaced."""


def stood_in(service: Service[Any], stand_ins: Iterable[StandIn]) -> Service[Any]:
    """The service with its publications replaced; itself where no stand-in is about it."""
    for name in stand_ins:
        make = TABLE.get((name, service.name))
        if make is not None:
            service = _hosted(service, make())
    return service


def _hosted(service: Service[Any], replacement: Replacement) -> Service[Any]:
    def build(config: ServiceConfig, node: Node) -> None:
        node.detail["stand_in"] = type(replacement).__name__
        service.build(config, cast(Node, StandInNode(node, replacement)))

    return Service(service.name, service.config, build)


class StandInNode:
    """A node as its service sees it: all of it, but that one topic is published by the replacement."""

    def __init__(self, node: Node, replacement: Replacement) -> None:
        self._node, self._replacement = node, replacement
        node.subscribe(topics.TRUTH, lambda truth, info: self._on_truth(truth, info.stamp_ns))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._node, name)

    def publish(self, topic: Topic[Any], message: Any, *, id: str | None = None, stamp_ns: int | None = None) -> None:
        """As a node does; of the replaced topic what the replacement has instead."""
        if topic is self._replacement.topic:
            at_ns = self._node.clock.now_ns() if stamp_ns is None else stamp_ns
            message = self._replacement.instead(message, at_ns)
        if message is not None:
            self._node.publish(topic, message, id=id, stamp_ns=stamp_ns)

    def _on_truth(self, truth: Truth, stamp_ns: int) -> None:
        message = self._replacement.truth(truth, stamp_ns)
        if message is not None:
            self._node.publish(self._replacement.topic, message, stamp_ns=stamp_ns)
