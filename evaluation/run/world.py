"""The world that a run is driven in."""

from evaluation.run.spec import RunSpec
from evaluation.scenarios import generate, read_place
from services.simulator.scenario.plan import Scenario
from services.simulator.service import find_scenario


def world_of(spec: RunSpec) -> tuple[Scenario, int]:
    """Scenario and seed for the simulator, of a generated layout or of a scenario by name or file."""
    place = read_place(spec.scenario)
    if place is None:
        return find_scenario(spec.scenario), spec.seed
    return generate(place.family, place.number, place.split), place.world_seed(spec.seed)
