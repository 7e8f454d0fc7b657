"""A run without an assistant: the simulator alone, its driver replaced; measured from truth by the same metrics."""

import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import msgspec

from drivemcp.paths import data
from evaluation.campaign.one import run_one
from evaluation.campaign.store import MEASURES, METRICS, SPEC, Kept, Store, world_digest
from evaluation.metrics import Record, measure
from evaluation.run.spec import RunSpec, run_key
from evaluation.run.world import world_of
from proto.truth import Truth
from services.simulator.driver.driver import Driver
from services.simulator.lockstep import EPOCH_NS
from services.simulator.session import SensorSet, Session
from studies.neighbours.following import Following, FollowingAll
from studies.neighbours.governor import Governed

LONGEST_S = 900.0
"""A neighbour that stands for good is not waited for."""
AFTER_COLLISION_S = 1.0
DRIVERS = "neighbours 1"
"""Raise the number when a neighbour drives otherwise: its runs are then driven anew."""
BLIND = SensorSet(cameras=(), lidar=False, gnss=False, map=False, weather=False, can=False)

NEIGHBOURS: Mapping[str, type[Driver]] = MappingProxyType(
    {"IDM alone": Following, "IDM, people and lines as leads": FollowingAll, "RSS governor": Governed}
)
"""Label to the class of the driver."""


def neighbour_truths(spec: RunSpec, driver: type[Driver] = Driver) -> tuple[Truth, ...]:
    """All of a run's truth; it ends with the route, after a collision, or after a quarter of an hour."""
    scenario, seed = world_of(spec)
    session = Session(
        scenario, seed, seconds=spec.seconds or LONGEST_S, epoch_ns=EPOCH_NS, dbc=data("vehicles/sim/sim.dbc"), bus="can0",
        present=BLIND, lockstep=True,
    )  # fmt: skip
    person = session.world.driver
    session.world.driver = chosen = driver(person.profile, person.believed_mps)
    truths: list[Truth] = []
    until_s = LONGEST_S
    while not session.finished and session.world.time_s < until_s:
        truths += [out.message for out in session.advance().messages if isinstance(out.message, Truth)]
        if isinstance(chosen, Following | Governed):
            chosen.truth = truths[-1]
        if truths[-1].collision:
            until_s = min(until_s, truths[-1].time_s + AFTER_COLLISION_S)
    return tuple(truths)


def key_of(spec: RunSpec, store: Store) -> str:
    """A run's name in the store; a neighbour's is of the neighbours' version, too."""
    if spec.method not in NEIGHBOURS:
        return store.key(spec)
    return run_key(spec, f"{world_digest(spec.sensors)} {DRIVERS}")


def run_any(folder: str, key: str, spec: RunSpec) -> Kept:
    """Drive and keep one run of the table, a neighbour's or one with all services."""
    if spec.method not in NEIGHBOURS:
        return run_one(folder, key, spec)
    store, began_s, began_cpu_s = Store(Path(folder)), time.monotonic(), time.process_time()
    part = store.start(key)
    truths = neighbour_truths(spec, NEIGHBOURS[spec.method])
    kept = Kept(
        metrics=msgspec.to_builtins(measure(Record(truths=truths))),
        moments=(),
        wall_s=time.monotonic() - began_s,
        cpu_s=time.process_time() - began_cpu_s,
        measured_by=MEASURES,
    )
    (part / SPEC).write_bytes(msgspec.json.format(msgspec.json.encode(spec)))
    (part / METRICS).write_bytes(msgspec.json.format(msgspec.json.encode(kept)))
    store.finish(key)
    return kept
