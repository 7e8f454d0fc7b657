"""A scenario driven to its end by the simulated driver alone: no sensors, no bus, no assistant."""

from collections import Counter
from typing import NamedTuple

from services.simulator.scenario.plan import Scenario
from services.simulator.world import World

LONGEST_S = 900.0


class Drive(NamedTuple):
    """What came of it."""

    ended: bool
    time_s: float
    distance_m: float
    hazards: tuple[tuple[str, float], ...]
    """Kind and onset of each."""
    infractions: dict[str, int]
    collision_s: float | None

    def __str__(self) -> str:
        hazards = ", ".join(f"{kind} at {onset_s:.0f} s" for kind, onset_s in self.hazards)
        broken = ", ".join(f"{count} {kind}" for kind, count in self.infractions.items())
        end = "to the end" if self.ended else "not to the end"
        hit = f"; collision at {self.collision_s:.0f} s" if self.collision_s is not None else ""
        return f"{self.distance_m:.0f} m in {self.time_s:.0f} s {end}; {hazards or 'no hazard'}; {broken or 'no infraction'}{hit}"


def drive_through(scenario: Scenario, seed: int) -> Drive:
    """Drive it; to the end, to a collision, or for a quarter of an hour."""
    world, hazards = World(scenario, seed), dict[tuple[str, float], None]()
    infractions, moment = Counter[str](), world.step()
    while not moment.ended and not moment.fact.collision and moment.time_s < LONGEST_S:
        moment = world.step()
        hazards |= dict.fromkeys((each.kind, each.onset_s) for each in moment.fact.hazards)
        infractions.update(filter(None, (moment.fact.infraction,)))
    hit = moment.time_s if moment.fact.collision else None
    return Drive(moment.ended, moment.time_s, moment.fact.distance_m, tuple(hazards), dict(infractions), hit)
