"""The truth of a run from its log alone: the simulator drives it again and hears at each step what was said then.

A lockstep run depends on nothing else; `off_mps` tells by how much the car's logged speed and the driven one differ at most.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.errors import MALFORMED, UserError
from drivemcp.paths import data
from evaluation.run.spec import RunSpec
from evaluation.run.world import world_of
from proto import topics
from proto.truth import Truth
from services.logger.format.reader import messages, topic_of
from services.simulator.lockstep import EPOCH_NS
from services.simulator.service import length_s
from services.simulator.session import SensorSet, Session
from studies.modelled_sensors.recording import KEPT, Recording

BUS = "can0"
_HEARD = {topics.ADVISORY.name, topics.BRAKE.name, topics.CAN_TX.name}
_BLIND = SensorSet(cameras=(), lidar=False, gnss=False, map=False)


def retell(log: Path, spec: RunSpec) -> Recording:
    """The recording of a lockstep run. Raises UserError where the file is not a log, or not of that run."""
    told, heard, speeds = Recording(spec=spec), defaultdict[int, list[Any]](list), dict[int, float]()
    names = {topic.name: name for name, topic in KEPT.items()}
    for logged in messages(log):
        topic = topic_of(logged.name)
        if topic is None or (topic.name not in names and topic.name not in _HEARD and topic is not topics.EGO):
            continue
        message = _decoded(topic, logged.data, log)
        if topic.name in names:
            getattr(told, names[topic.name]).append((logged.stamp_ns, message))
        if topic.name in _HEARD:
            heard[logged.log_time_ns].append(message)
        if topic is topics.EGO and message.speed_mps is not None:
            speeds[logged.stamp_ns] = message.speed_mps
    told.truths = _driven(spec, heard, max(speeds, default=0))
    if off_mps(told, speeds) > 1.0:
        raise UserError(f"{log}: this is no run of {spec.scenario}, seed {spec.seed}, with the simulator as it is now")
    return told


def off_mps(told: Recording, speeds: Mapping[int, float]) -> float:
    """By how much the logged and the driven speed differ at most."""
    return max((abs(truth.speed_mps - speeds[at]) for at, truth in told.truths if at in speeds), default=0.0)


def _driven(spec: RunSpec, heard: Mapping[int, list[Any]], until_ns: int) -> list[tuple[int, Truth]]:
    scenario, seed = world_of(spec)
    session = Session(
        scenario,
        seed,
        seconds=length_s(scenario, spec.seconds),
        epoch_ns=EPOCH_NS,
        dbc=data("vehicles/sim/sim.dbc"),
        bus=BUS,
        present=_BLIND,
        lockstep=True,
    )
    truths: list[tuple[int, Truth]] = []
    while not session.finished and (not truths or truths[-1][0] < until_ns):
        batch = session.advance()
        truths += [(batch.stamp_ns, out.message) for out in batch.messages if isinstance(out.message, Truth)]
        for message in heard.get(batch.stamp_ns, ()):
            _HEAR[type(message)](session, message, batch.stamp_ns)
    return truths


_HEAR: dict[type, Callable[[Session, Any, int], object]] = {
    topics.ADVISORY.message: lambda session, message, _: session.hear(message),
    topics.BRAKE.message: lambda session, message, _: session.brake(message),
    topics.CAN_TX.message: lambda session, message, now_ns: session.request(message.frames, now_ns),
}


def _decoded(topic: topics.Topic[Any], packed: bytes, log: Path) -> Any:
    try:
        return msgspec.json.decode(packed, type=topic.message)  # whatever the bus carried, a log holds JSON
    except MALFORMED as error:
        raise UserError(f"{log}: {topic.name} does not fit this version: {error}") from None
