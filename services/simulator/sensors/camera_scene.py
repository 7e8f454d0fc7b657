"""From the world's state to what cameras see: actors with their looks, panels, lights, atmosphere."""

from collections.abc import Iterable, Mapping

from services.simulator.people.pedestrians import PERSON_IDS, STEP_CYCLE_M, Person
from services.simulator.road.furniture import AUX_PANEL, light_id, panel_id
from services.simulator.road.gantries import Shown
from services.simulator.road.highway_env_road import to_pose
from services.simulator.road.route import Route
from services.simulator.road.stop_lines import Lights, Line
from services.simulator.scene.scene import Actor, LightState
from services.simulator.traffic.cars import Car

BRAKE_LAMPS_FROM_MPS2 = -0.5


def car_actor(car: Car, lights_on: bool) -> Actor:
    """A car as it looks."""
    return Actor(
        id=car.number,
        kind=car.body.kind,
        pose=to_pose(car.position, car.heading),
        length_m=car.body.length_m,
        width_m=car.body.width_m,
        height_m=car.body.height_m,
        look_seed=car.body.look_seed,
        mesh_family=car.body.mesh_family,
        braking=car.applied_mps2 < BRAKE_LAMPS_FROM_MPS2 or car.speed < 0.2,
        lights_on=lights_on,
    )


def person_actor(route: Route, person: Person) -> Actor:
    """A person on foot. A person who waits looks across the road; a person who moves looks along the way walked."""
    return Actor(
        id=PERSON_IDS + person.number,
        kind="pedestrian",
        pose=route.pose(person.s_m, person.d_m, _facing(person)),
        length_m=0.45,
        width_m=0.55,
        height_m=person.height_m,
        look_seed=person.look_seed,
        mesh_family=person.look_seed % 97,
        walk_phase=person.walked_m / STEP_CYCLE_M,
    )


def _facing(person: Person) -> float:
    quarter = 1.5707963267948966
    if person.mode == "walking" and person.along_mps:
        return 0.0 if person.along_mps > 0 else 2 * quarter
    across = person.across_mps or -person.d_m
    return quarter if across > 0 else -quarter


def near_parked(parked: Iterable[tuple[float, Actor]], ego_s_m: float) -> list[Actor]:
    """The parked cars that can be seen; each comes with its place along the route."""
    return [actor for s, actor in parked if -30.0 < s - ego_s_m < 220.0]


def panels(route: Route, shown: Mapping[int, Shown]) -> dict[int, str]:
    """Panel ids to codes."""
    codes: dict[int, str] = {}
    for ordinal, each in shown.items():
        codes |= {panel_id(ordinal, lane): each.over(lane) for lane in range(route.section.lanes)}
        if route.section.lanes > 1:
            codes[panel_id(ordinal, AUX_PANEL)] = each.symbol
    return codes


def heads(lines: Iterable[Line], lights: Lights) -> dict[int, LightState]:
    """Light ids to states."""
    states: dict[int, LightState] = {}
    for line in lines:
        if line.kind == "light":
            ahead = lights.state(line)
            states |= {light_id(line.ordinal, 0): ahead, light_id(line.ordinal, 1): ahead}
            states[light_id(line.ordinal, 2)] = lights.state(line, oncoming=True)
    return states
