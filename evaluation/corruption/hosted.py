"""A service whose publications are corrupted as they leave. The service is the one of production, and knows nothing of it."""

import threading
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, cast

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from evaluation.corruption.corruptor import Corruptor
from evaluation.corruption.spec import CorruptionSpec
from proto import topics
from proto.topics import Topic

MODULE = "evaluation.corruption"
RATES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "simulator": ("blackout", "freeze", "lidar_loss", "jitter_ms"),
        "player": ("blackout", "freeze", "jitter_ms"),
        "perception": ("dropout",),
        "drivelm": ("sign_miss", "limit_misread"),
    }
)
"""Whose publications each rate corrupts."""
_KNOWS_TRUTH = "simulator"


def hosts(spec: CorruptionSpec) -> dict[str, tuple[str, ...]]:
    """The services that have to be hosted for a corruption: module and arguments that are run in place of each."""
    return {name: (MODULE, name, spec.text()) for name, rates in RATES.items() if spec.touches(*rates)}


def hosted(service: Service[Any], spec: CorruptionSpec) -> Service[Any]:
    """The same service, corrupted. It starts on any bus, in a process or in a test, as every service does."""

    def build(config: ServiceConfig, node: Node) -> None:
        node.detail["corruption"] = spec.text()
        service.build(config, cast(Node, CorruptedNode(node, Corruptor(spec))))

    return Service(service.name, service.config, build)


class CorruptedNode:
    """A node as its service sees it: all of it, but that what is published goes through the corruptor first."""

    def __init__(self, node: Node, corruptor: Corruptor) -> None:
        self._node, self._corruptor = node, corruptor
        self._lock = threading.RLock()
        if node.name != _KNOWS_TRUTH:
            node.subscribe(topics.TRUTH, lambda truth, info: corruptor.truth(truth, info.stamp_ns))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._node, name)

    def publish(self, topic: Topic[Any], message: Any, *, id: str | None = None, stamp_ns: int | None = None) -> None:
        """As a node does, with what is left. What is lost is not numbered: a lost sweep is no gap, it never was."""
        at_ns = self._node.clock.now_ns() if stamp_ns is None else stamp_ns
        with self._lock:  # numbers and windows in one order
            if topic is topics.TRUTH:
                self._corruptor.truth(message, at_ns)
            elif topic is topics.FACTS:
                self._move(at_ns)
            left = self._corruptor.leave(topic, message, id or self._node.name, at_ns)
            if left.message is not None:
                self._node.publish(topic, left.message, id=id, stamp_ns=left.stamp_ns)
            for record in left.records:
                self._node.publish(topics.CORRUPTED, record, stamp_ns=at_ns)

    def _move(self, now_ns: int) -> None:
        ego = self._node.latest(topics.EGO)
        if ego is not None:
            self._corruptor.moved(ego.message.speed_mps or 0.0, now_ns)
