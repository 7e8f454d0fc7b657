"""The route of a scenario: its cross-section, its stretches, where the kerb runs, and where the road is interrupted."""

from dataclasses import dataclass
from functools import cached_property

from services.simulator.road.cross_section import CrossSection
from services.simulator.road.spine import Bend, build_spine
from services.simulator.scenario.plan import Scenario, StretchPlan
from services.simulator.scene.scene import Pose

PARKING_M = 2.2
SHOULDER_M = 2.5
JUNCTION_AFTER_LINE_M = 11.0
"""From a stop line to the middle of the side road behind it."""
JUNCTION_HALF_M = 5.0


@dataclass(frozen=True)
class Route:
    """Geometry that road, furniture, traffic and sensors share."""

    scenario: Scenario

    @cached_property
    def section(self) -> CrossSection:
        """Lanes across the route."""
        road = self.scenario.road
        bends = tuple(
            Bend(bend.length_m, 0.0 if bend.radius_m is None else (1 if bend.turn == "left" else -1) / bend.radius_m)
            for bend in road.bends
        )
        return CrossSection(
            build_spine(bends), road.lanes, road.lane_width_m, road.median_m, road.side, road.changeover_m
        )

    @property
    def length_m(self) -> float:
        """Length of the route."""
        return self.section.spine.length_m

    def stretch_at(self, s_m: float) -> StretchPlan:
        """The stretch at s."""
        return [stretch for stretch in self.scenario.road.stretches if stretch.from_m <= s_m or s_m < 0][
            -1 if s_m >= 0 else 0
        ]

    def stretch_ends(self) -> list[tuple[StretchPlan, float, float]]:
        """Every stretch with its start and end."""
        stretches = self.scenario.road.stretches
        ends = [stretch.from_m for stretch in stretches[1:]] + [self.length_m]
        return [(stretch, stretch.from_m, end) for stretch, end in zip(stretches, ends, strict=True)]

    def reach_m(self, s_m: float) -> float:
        """Half the width of the carriageway."""
        return self.section.reach_m(s_m)

    def kerb_m(self, s_m: float) -> float:
        """|d| of the kerb, or of the outer edge of the shoulder."""
        stretch = self.stretch_at(s_m)
        beside = PARKING_M if stretch.parked else SHOULDER_M if stretch.road_class == "motorway" else 0.0
        return self.reach_m(s_m) + beside

    def near(self, s_m: float) -> float:
        """The sign of d on the side on which one drives."""
        return self.section.sign(s_m)

    def pose(self, s_m: float, d_m: float, turn_rad: float = 0.0) -> Pose:
        """A place beside the road, its yaw the road's plus a turn."""
        x, y = self.section.spine.place(s_m, d_m)
        inside = min(max(s_m, 0.0), self.length_m)
        return Pose(x_m=x, y_m=y, yaw_rad=self.section.spine.yaw(inside) + turn_rad)

    def junctions(self) -> list[float]:
        """The middles of side roads: behind the lights that have one, behind stop signs, and where one gives way."""
        plan = self.scenario
        lights = [light for light in plan.lights if light.side_road]
        return sorted(each.at_m + JUNCTION_AFTER_LINE_M for each in (*lights, *plan.stops, *plan.yields))

    def at_junction(self, s_m: float, margin_m: float = 0.0) -> bool:
        """Whether s lies in the mouth of a side road."""
        return any(abs(s_m - middle) <= JUNCTION_HALF_M + margin_m for middle in self.junctions())
