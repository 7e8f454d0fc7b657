"""A scenario being drafted from its start to its end: road is laid at a cursor, things are put some metres beyond it."""

import math
from dataclasses import dataclass, field
from random import Random
from typing import Any, Literal

from services.simulator.scenario.plan import (
    BendPlan,
    CrossCarPlan,
    CrosserPlan,
    EgoPlan,
    GantryPlan,
    LightPlan,
    QueuePlan,
    RoadClass,
    RoadPlan,
    Scenario,
    SignPlan,
    StopPlan,
    StretchPlan,
    Surroundings,
    VehiclePlan,
    WalkersPlan,
    WaterPlan,
    WeatherPlan,
    YieldPlan,
    ZebraPlan,
)

CROSS_CAR_M = 58.0
"""From where a car starts in a side road to the ego's lane."""
Side = Literal["right", "left"]
MOST_TURNED_RAD = math.radians(65.0)
"""A route never turns further than this from its first direction, so that it cannot meet itself."""


@dataclass(slots=True)
class Draft:
    """What has been laid so far; `at_m` is its end, where the next block begins."""

    chance: Random
    """Draws the layout and nothing else."""
    at_m: float = 0.0
    turned_rad: float = 0.0
    bends: list[BendPlan] = field(default_factory=list)
    stretches: list[StretchPlan] = field(default_factory=list)
    signs: list[SignPlan] = field(default_factory=list)
    lights: list[LightPlan] = field(default_factory=list)
    stops: list[StopPlan] = field(default_factory=list)
    yields: list[YieldPlan] = field(default_factory=list)
    zebras: list[ZebraPlan] = field(default_factory=list)
    water: list[WaterPlan] = field(default_factory=list)
    gantries: list[GantryPlan] = field(default_factory=list)
    walkers: list[WalkersPlan] = field(default_factory=list)
    crossers: list[CrosserPlan] = field(default_factory=list)
    vehicles: list[VehiclePlan] = field(default_factory=list)
    queues: list[QueuePlan] = field(default_factory=list)

    # The road ----------------------------------------------------------------------------------------------------------

    def straight(self, length_m: float) -> None:
        """Straight on."""
        self.bends.append(BendPlan(length_m=length_m))
        self.at_m += length_m

    def bend(self, radius_m: float, degrees: float) -> None:
        """A bend, to the side that keeps the route's direction."""
        angle = math.radians(degrees)
        left = self.chance.random() < 0.5
        if abs(self.turned_rad + (angle if left else -angle)) > MOST_TURNED_RAD:
            left = self.turned_rad < 0.0
        self.turned_rad += angle if left else -angle
        length_m = round(radius_m * angle, 1)
        self.bends.append(BendPlan(length_m=length_m, radius_m=radius_m, turn="left" if left else "right"))
        self.at_m += length_m

    def stretch(self, road_class: RoadClass, surroundings: Surroundings, **more: Any) -> None:
        """From the cursor on the road is like this."""
        stretch = StretchPlan(from_m=self.at_m, road_class=road_class, surroundings=surroundings, **more)
        if self.stretches and self.stretches[-1].from_m == self.at_m:
            self.stretches.pop()
        self.stretches.append(stretch)

    # What stands and happens on it -------------------------------------------------------------------------------------

    def sign(self, ahead_m: float, *codes: str, **more: Any) -> None:
        """A post."""
        self.signs.append(SignPlan(at_m=self.at_m + ahead_m, codes=codes, **more))

    def walk(self, from_m: float, to_m: float, count: int, **more: Any) -> None:
        """People on the pavement."""
        self.walkers.append(WalkersPlan(from_m=self.at_m + from_m, to_m=self.at_m + to_m, count=count, **more))

    def cross(self, ahead_m: float, **more: Any) -> None:
        """A person who crosses."""
        self.crossers.append(CrosserPlan(at_m=self.at_m + ahead_m, **more))

    def vehicle(self, ahead_m: float, **more: Any) -> None:
        """A vehicle with a part of its own."""
        self.vehicles.append(VehiclePlan(at_m=round(self.at_m + ahead_m, 1), **more))

    def give_way(self, ahead_m: float, limit_kmh: float, *, from_side: Side, sign: bool = False) -> None:
        """A junction with a car that comes to it as the ego does when it drives at the limit."""
        speed_kmh = round(self.chance.uniform(24.0, 34.0), 1)
        arrives_s = CROSS_CAR_M / (speed_kmh / 3.6) - self.chance.uniform(1.0, 2.0)
        car = CrossCarPlan(from_side=from_side, speed_kmh=speed_kmh, when_ego_within_m=arrives_s * limit_kmh / 3.6)
        self.yields.append(YieldPlan(at_m=self.at_m + ahead_m, sign=sign, cars=(car,)))

    def stands(self, ahead_m: float, **more: Any) -> None:
        """A vehicle that stands in the ego's lane, and drives on some seconds after one has come near."""
        self.vehicle(ahead_m, speed_kmh=0.0, stands_s=9.0, **more)

    # Done --------------------------------------------------------------------------------------------------------------

    def scenario(self, *, name: str, about: str, country: str, speed_kmh: float, **more: Any) -> Scenario:
        """The scenario of what was laid; weather, light, traffic and driver come with the variation."""
        road: dict[str, Any] = more.pop("road", {})
        ego: dict[str, Any] = more.pop("ego", {})
        laid: dict[str, Any] = {group: tuple(getattr(self, group)) for group in _GROUPS}
        return Scenario(
            name=name,
            about=about,
            country=country,  # type: ignore[arg-type]
            road=RoadPlan(bends=tuple(self.bends), stretches=tuple(self.stretches), **road),
            ego=EgoPlan(at_m=15.0, speed_kmh=speed_kmh, **ego),
            weather=(WeatherPlan(at_s=0.0),),
            **laid,
            **more,
        )


_GROUPS = (
    "signs",
    "lights",
    "stops",
    "yields",
    "zebras",
    "water",
    "gantries",
    "walkers",
    "crossers",
    "vehicles",
    "queues",
)
