"""The scenes of the table: what stands, drives or walks before the car, at which speeds, and which impacts the regulation permits.

Speeds and impacts are those of UN Regulation 152 (cars) as far as known here. Roads are straight and empty but for the scene. What the
simulator cannot draw is said in `Scene.about`.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal

import msgspec

from evaluation.metrics.conflicts import EGO_LENGTH_M
from services.simulator.road.layout import SIDE_ROAD_M
from services.simulator.road.route import JUNCTION_AFTER_LINE_M
from services.simulator.scenario.plan import (
    BendPlan,
    CrossCarPlan,
    CrosserPlan,
    EgoPlan,
    FaultPlan,
    HaltPlan,
    LaneChangePlan,
    RoadPlan,
    Scenario,
    SignPlan,
    StretchPlan,
    TrafficPlan,
    VehiclePlan,
    WalkersPlan,
    WaterPlan,
    WeatherPlan,
    YieldPlan,
)

Ground = Literal["dry", "wet", "weak brakes"]
Kind = Literal["avoid", "pass"]
"""`avoid`: an impact threatens; `pass`: nothing does, and any braking is a false reaction."""
Plans = dict[str, Any]
WIDTH_M, START_M = 3.5, 20.0
WALKS_MPS = 5.0 / 3.6
SIDE_MPS, SIDE_HALTS_MPS2 = 28.0 / 3.6, 3.0
SIDE_WAY_M = SIDE_ROAD_M - 6.0
"""From where a car of a side road sets off to the road's edge."""
LEADS_S = 6.0
"""So long before contact the car sets off; longer at low speeds, so that a picture shows what stands."""
LEAST_M = 60.0
RAIN_MM_H = 4.0
"""Makes a peak friction of about 0.5."""
WEAK = "booster_lost"


class Scene(msgspec.Struct, frozen=True, kw_only=True):
    """One scene: its speeds (km/h) with the impact (km/h) that is permitted; None: no limit is known."""

    name: str
    about: str
    kind: Kind
    speeds: Mapping[int, float | None]
    quick: tuple[int, ...]
    """The speeds of a quick table."""
    plans: Callable[[float], Plans]
    """Fields of the scenario by the ego's speed (m/s)."""
    seconds: Callable[[float], float]


def gap_m(speed_mps: float) -> float:
    """From the car to what stands in its way, at the start."""
    return max(LEAST_M, LEADS_S * speed_mps)


def _standing(speed_mps: float) -> Plans:
    at_m = START_M + EGO_LENGTH_M + gap_m(speed_mps)
    return {"vehicles": (VehiclePlan(at_m=at_m, speed_kmh=0.0, keeps_kmh=0.1, stands_s=1000.0),)}


def _moving(speed_mps: float) -> Plans:
    closing = max(1.0, speed_mps - 20 / 3.6)
    return {"vehicles": (_lead(max(40.0, LEADS_S * closing), 20.0),)}


def _lead(gap: float, kmh: float, **fields: Any) -> VehiclePlan:
    return VehiclePlan(
        at_m=START_M + EGO_LENGTH_M + gap, speed_kmh=kmh, keeps_kmh=kmh, heeds_limits=False, **{"lane": 0, **fields}
    )


def _braking(speed_mps: float) -> Plans:
    gap = 40.0
    halt = HaltPlan(
        at_m=START_M + EGO_LENGTH_M + gap + 3.0 * speed_mps + speed_mps**2 / 8.0, hold_s=60.0, brake_mps2=4.0
    )
    return {"vehicles": (_lead(gap, speed_mps * 3.6, halts=(halt,)),)}


def _cut_in(speed_mps: float) -> Plans:
    change = LaneChangePlan(
        to_lane=0, when_ego_at_m=START_M + 3.0 * speed_mps, paces_m=12.0, then_kmh=speed_mps * 3.6 - 20
    )
    return {"vehicles": (_lead(12.0, speed_mps * 3.6, lane=1, lane_change=change),)}


def _crossing(speed_mps: float) -> Plans:
    """The person crosses an empty lane first, for about four seconds, and is before the car's middle as the car comes."""
    way_m = 0.5 + 1.5 * WIDTH_M
    ahead_m = speed_mps * way_m / WALKS_MPS
    at_m = START_M + EGO_LENGTH_M + ahead_m + max(20.0, 2.0 * speed_mps)
    return {"crossers": (CrosserPlan(at_m=at_m, walk_mps=WALKS_MPS, when_ego_within_m=ahead_m),)}


def _bend(speed_mps: float) -> Plans:
    bends = (BendPlan(length_m=60.0), BendPlan(length_m=150.0, radius_m=120.0, turn="left"), BendPlan(length_m=400.0))
    stretch = StretchPlan(from_m=0.0, road_class="urban", surroundings="houses", pavement=True, parked=8.0)
    return {"road": RoadPlan(lanes=1, lane_width_m=WIDTH_M, bends=bends, stretches=(stretch,))}


def _turns_off(speed_mps: float) -> Plans:
    gap = 45.0
    change = LaneChangePlan(to_lane=1, when_ego_at_m=START_M + 1.5 * speed_mps)
    return {"vehicles": (_lead(gap, max(15.0, speed_mps * 3.6 - 15.0), lane_change=change),)}


def _manhole(speed_mps: float) -> Plans:
    at_m = START_M + gap_m(speed_mps)
    return {"water": (WaterPlan(from_m=at_m, to_m=at_m + 1.0, film_mm=0.5),)}


def _kerb(speed_mps: float) -> Plans:
    at_m = START_M + gap_m(speed_mps)
    waiting = WalkersPlan(from_m=at_m, to_m=at_m + 1.0, count=1, side="near", mode="waiting")
    return {"walkers": (waiting,), "road": _road(1)}


def _walks_up(speed_mps: float) -> Plans:
    """The person comes from 3 m behind the kerb, and stops at it two seconds before the car is there."""
    before_s = 2.0 + 3.0 / WALKS_MPS
    ahead_m = max(before_s * speed_mps, EGO_LENGTH_M)
    at_m = START_M + EGO_LENGTH_M + ahead_m + max(20.0, 2.0 * speed_mps)
    person = CrosserPlan(at_m=at_m, walk_mps=WALKS_MPS, when_ego_within_m=ahead_m, walks_up_m=3.0)
    return {"crossers": (person,), "road": _road(1)}


def _from_the_side(speed_mps: float) -> Plans:
    """Both would be at one place at one time."""
    return _junction(speed_mps, SIDE_WAY_M / SIDE_MPS, CrossCarPlan(speed_kmh=SIDE_MPS * 3.6, when_ego_within_m=1.0))


def _halts_aside(speed_mps: float) -> Plans:
    """The car stands a second before the ego comes."""
    halts_s = SIDE_WAY_M / SIDE_MPS + SIDE_MPS / (2.0 * SIDE_HALTS_MPS2)
    car = CrossCarPlan(speed_kmh=SIDE_MPS * 3.6, when_ego_within_m=1.0, halts_mps2=SIDE_HALTS_MPS2)
    return _junction(speed_mps, halts_s + 1.0, car)


def _junction(speed_mps: float, after_s: float, car: CrossCarPlan) -> Plans:
    """A side road from the right, out of which that car sets off so long before the ego would be there."""
    ahead_m = speed_mps * after_s - JUNCTION_AFTER_LINE_M
    at_m = START_M + EGO_LENGTH_M + ahead_m + max(20.0, 2.0 * speed_mps)
    cars = (msgspec.structs.replace(car, when_ego_within_m=ahead_m),)
    return {"yields": (YieldPlan(at_m=at_m, cars=cars),), "road": _road(1)}


def _to_contact(speed_mps: float) -> float:
    return gap_m(speed_mps) / speed_mps + 6.0


def _of(*scenes: Scene) -> Mapping[str, Scene]:
    return MappingProxyType({scene.name: scene for scene in scenes})


SCENES = _of(
    Scene(
        name="standing car", kind="avoid", plans=_standing, seconds=_to_contact, quick=(20, 40, 50, 60),
        about="A car that stands in the lane.",
        speeds={20: 0.0, 30: 0.0, 40: 0.0, 42: 10.0, 45: 15.0, 50: 25.0, 55: 30.0, 60: 35.0},
    ),
    Scene(
        name="moving car", kind="avoid", plans=_moving, seconds=lambda v: 14.0, quick=(40, 60),
        about="A car that drives 20 km/h.", speeds={30: 0.0, 40: 0.0, 50: 0.0, 60: 0.0},
    ),
    Scene(
        name="crossing person", kind="avoid", plans=_crossing, seconds=lambda v: 4.0 + max(2.0, 20.0 / v) + 3.0, quick=(20, 40, 60),
        about="An adult who walks 5 km/h from the near side and is before the middle of the car as it comes.",
        speeds={20: 0.0, 25: 0.0, 30: 0.0, 35: 20.0, 40: 25.0, 45: 30.0, 50: 35.0, 55: 40.0, 60: 45.0},
    ),
    Scene(
        name="braking lead", kind="avoid", plans=_braking, seconds=lambda v: 14.0, quick=(50,),
        about="A car at the same speed, 40 m ahead, that brakes with 4 m/s² to a halt.", speeds={50: None, 60: None},
    ),
    Scene(
        name="cut-in", kind="avoid", plans=_cut_in, seconds=lambda v: 12.0, quick=(50,),
        about="A car that cuts in 12 m ahead and drives 20 km/h slower.", speeds={50: None, 60: None},
    ),
    Scene(
        name="car from the side", kind="avoid", plans=_from_the_side, seconds=lambda v: 14.0, quick=(50,),
        about="A car that comes out of a side road from the right at 28 km/h, has right of way, and would meet the car.",
        speeds={30: None, 40: None, 50: None, 60: None},
    ),
    Scene(
        name="parked cars in a bend", kind="pass", plans=_bend, seconds=lambda v: 300.0 / v, quick=(40,),
        about="Cars parked beside the lane, in and before a bend of 120 m.", speeds={30: None, 40: None, 50: None},
    ),
    Scene(
        name="car that turns off", kind="pass", plans=_turns_off, seconds=lambda v: 9.0, quick=(50,),
        about="A slower car that leaves the lane; it changes lanes, as cars of the simulator do not turn off.",
        speeds={40: None, 50: None, 60: None},
    ),
    Scene(
        name="manhole", kind="pass", plans=_manhole, seconds=_to_contact, quick=(50,),
        about="A thing flat on the road; it is a metre of water, as the simulator draws no manhole.", speeds={30: None, 50: None, 60: None},
    ),
    Scene(
        name="person at the kerb", kind="pass", plans=_kerb, seconds=_to_contact, quick=(50,),
        about="A person who stands half a metre behind the kerb.", speeds={30: None, 50: None, 60: None},
    ),
    Scene(
        name="person who walks up to the kerb", kind="pass", plans=_walks_up, seconds=lambda v: 4.0 + max(2.0, 20.0 / v) + 6.0,
        quick=(50,), about="An adult who walks 5 km/h towards the road and stops half a metre behind the kerb.",
        speeds={30: None, 50: None, 60: None},
    ),
    Scene(
        name="car that halts at a side road", kind="pass", plans=_halts_aside, seconds=lambda v: 14.0, quick=(50,),
        about="A car that comes out of a side road from the right at 28 km/h, brakes with 3 m/s² and halts at the road's edge, "
        "though it has right of way.", speeds={30: None, 50: None, 60: None},
    ),
)  # fmt: skip
GROUNDS: tuple[Ground, ...] = ("dry", "wet", "weak brakes")


def _road(lanes: int) -> RoadPlan:
    stretch = StretchPlan(from_m=0.0, road_class="urban", surroundings="fields")
    return RoadPlan(lanes=lanes, lane_width_m=WIDTH_M, bends=(BendPlan(length_m=1000.0),), stretches=(stretch,))


def scenario(scene: Scene, speed_kmh: int, ground: Ground) -> Scenario:
    """The scenario of a cell."""
    fields: Plans = {
        "road": _road(2),
        "weather": (WeatherPlan(at_s=0.0, rain_mm_h=RAIN_MM_H if ground == "wet" else 0.0),),
        "faults": (FaultPlan(preset=WEAK),) if ground == "weak brakes" else (),
        **scene.plans(speed_kmh / 3.6),
    }
    return Scenario(
        name="guard", country="DEU", ego=EgoPlan(at_m=START_M, lane=0, speed_kmh=float(speed_kmh)),
        traffic=TrafficPlan(forward=0, oncoming=0), signs=(SignPlan(at_m=5.0, codes=("town_entry",), text="Neuenau"),), **fields,
    )  # fmt: skip
