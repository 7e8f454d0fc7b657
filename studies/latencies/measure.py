"""Drives short runs through all services and takes the wall time of each call and picture as it happens.

Questions and answers are those of real drives, over the session that all runs use. In lockstep nothing else of ours runs
while a call is answered, so that live, on a machine with too few cores, calls take longer.
"""

import os
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, cast

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from evaluation.campaign.machine import machine
from evaluation.run.host import drive
from evaluation.run.latencies import Latencies, took
from evaluation.run.methods import METHODS, applied
from evaluation.run.spec import RunSpec
from proto import topics
from proto.services import SERVICES
from proto.tools import CallRecords
from proto.topics import Topic


class Stage(NamedTuple):
    """Work of a service that begins with a message; what it does on others until the next such message counts to it."""

    name: str
    begins: Topic[Any]


STAGES: Mapping[str, Stage] = {
    "perception": Stage("perception, a picture", topics.CAMERA),
    "drivelm": Stage("front end, a picture", topics.CAMERA),
    "orchestrator": Stage("orchestrator, a tick", topics.TRACKS),
}
PLAN: tuple[tuple[str, str, RunSpec], ...] = (
    ("DriveMCP", "rendered", RunSpec(scenario="urb-rain/calibration/0", seed=1)),
    ("DriveMCP", "model", RunSpec(scenario="cross-border/calibration/0", seed=1, sensors="model")),
    ("DriveMCP", "model", RunSpec(scenario="dynamic-vsl/calibration/0", seed=1, sensors="model")),
    ("VLM-Direct+RAG", "model", RunSpec(scenario="cross-border/calibration/1", seed=2, sensors="model")),
)
"""Pictures are measured where they are drawn; the front end's prompt where a method asks for it."""


class Times:
    """Samples in ms, by what was measured."""

    def __init__(self) -> None:
        self.calls: dict[str, list[float]] = defaultdict(list)
        self.stages: dict[str, list[float]] = defaultdict(list)

    def follow(self, node: Node) -> None:
        """Hear what the callers log of their calls."""
        for row in SERVICES:
            node.subscribe(topics.CALLS, lambda message, _: self._called(message), id=row.name)

    def _called(self, message: CallRecords) -> None:
        for record in message.records:
            if record.side == "caller" and record.status == "ok":
                self.calls[record.tool].append((record.done_ns - record.sent_ns) / 1e6)

    def timed(self, service: Service[Any]) -> Service[Any]:
        """The service with its work timed; itself where none of it is a stage."""
        stage = STAGES.get(service.name)
        if stage is None:
            return service
        samples = self.stages[stage.name]

        def build(config: ServiceConfig, node: Node) -> None:
            service.build(config, cast(Node, _TimedNode(node, stage, samples)))

        return Service(service.name, service.config, build)


class _TimedNode:
    """A node as its service sees it; what its subscriptions' callbacks take is noted."""

    def __init__(self, node: Node, stage: Stage, samples: list[float]) -> None:
        self._node, self._stage, self._samples = node, stage, samples

    def __getattr__(self, name: str) -> Any:
        return getattr(self._node, name)

    def subscribe(
        self, topic: Topic[Any], callback: Callable[[Any, Any], None] | None = None, *, id: str | None = None
    ) -> None:
        """As a node does."""
        self._node.subscribe(topic, callback and self._around(topic, callback), id=id)

    def _around(self, topic: Topic[Any], callback: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
        def timed(message: Any, info: Any) -> None:
            began_s = time.perf_counter()
            callback(message, info)
            took_ms = (time.perf_counter() - began_s) * 1e3
            if topic is self._stage.begins:
                self._samples.append(took_ms)
            elif self._samples:
                self._samples[-1] += took_ms

        return timed


def measure(seconds: float, plan: tuple[tuple[str, str, RunSpec], ...] = PLAN) -> Iterator[str | Latencies]:
    """What is being driven, line by line, and at last what was found."""
    load, told, all_times = os.getloadavg()[0], [], Times()
    for label, sensors, base in plan:
        spec = msgspec.structs.replace(applied(METHODS[label], base), seconds=seconds)
        told.append(f"{label}, {spec.scenario}, seed {spec.seed}, {seconds:g} s, {sensors} sensors")
        yield told[-1]
        times = Times()
        with TemporaryDirectory(prefix="drivemcp-latencies-") as folder:
            drive(spec, Path(folder), times.follow, times.timed)
        _add(times, all_times, pictures=sensors == "rendered")
    yield Latencies(
        machine=machine(),
        load=round(load, 2),
        runs=tuple(told),
        tools={name: took(samples) for name, samples in sorted(all_times.calls.items())},
        stages={name: took(samples) for name, samples in all_times.stages.items() if samples},
    )


def _add(times: Times, to: Times, *, pictures: bool) -> None:
    for name, samples in times.calls.items():
        to.calls[name] += samples
    for stage in STAGES.values():
        if pictures or stage.begins is not topics.CAMERA:
            to.stages[stage.name] += times.stages[stage.name]
