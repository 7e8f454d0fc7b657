"""Stop lines and traffic lights.

At lights a car stops while they say so, at stop signs until it has stood, at give way signs for traffic that comes. A light
is a cycle in time, begun by a car that approaches where the scenario says so.
"""

from dataclasses import dataclass, field
from typing import Literal

from services.simulator.road.layout import opposite_line_m
from services.simulator.road.route import Route
from services.simulator.scenario.plan import LightPlan
from services.simulator.scene.scene import LightState

CLEARANCE_S = 2.0
"""Between the end of one direction's amber and the other's green."""


@dataclass(frozen=True, slots=True)
class Cycle:
    """A running light: the plan, and when the first approach made it leave green (None: no car has approached yet)."""

    plan: LightPlan
    begun_s: float | None = None

    def approached(self, time_s: float, distance_m: float) -> "Cycle":
        """The light after a car has been seen that far before it."""
        trigger = self.plan.red_on_approach_m
        if trigger is None or self.begun_s is not None or not 0.0 < distance_m <= trigger:
            return self
        return Cycle(self.plan, time_s)

    def state(self, time_s: float) -> LightState:
        """What cars see."""
        plan, phase = self.plan, self._phase(time_s)
        if phase is None:
            return "green"
        for length, state in self._course():
            if phase < length:
                return state
            phase -= length
        raise AssertionError(f"phase beyond the cycle of {plan}")

    def opposing(self, time_s: float) -> LightState:
        """The state for traffic that may only go while this direction has red (other side of a changeover, side road)."""
        phase, plan = self._phase(time_s), self.plan
        if phase is None:
            return "red"
        opens, closes = plan.amber_s + CLEARANCE_S, plan.amber_s + plan.red_s - CLEARANCE_S - plan.amber_s
        if opens <= phase < closes:
            return "green"
        return "amber" if closes <= phase < closes + plan.amber_s and closes > opens else "red"

    def _course(self) -> tuple[tuple[float, LightState], ...]:
        plan = self.plan
        return (
            (plan.amber_s, "amber"),
            (plan.red_s, "red"),
            (plan.red_amber_s, "red_amber"),
            (plan.green_s + 1e-6, "green"),
        )

    def _phase(self, time_s: float) -> float | None:
        """Seconds into the cycle, which starts with amber."""
        plan = self.plan
        if plan.red_on_approach_m is None:
            begun = plan.offset_s
        elif self.begun_s is None:
            return None
        else:
            begun = self.begun_s
        whole = plan.amber_s + plan.red_s + plan.red_amber_s + plan.green_s
        return (time_s - begun) % whole


STANDS_BELOW_MPS, STANDS_FOR_S, STANDS_WITHIN_M = 0.25, 1.2, 6.0
HARDEST_FOR_AMBER_MPS2 = 3.0
LineKind = Literal["light", "stop_line", "yield"]


@dataclass(frozen=True, slots=True)
class Line:
    """A stop line of the forward lanes; `ordinal` counts within its kind, `key` is unique."""

    key: int
    kind: LineKind
    ordinal: int
    at_m: float
    opposite_m: float | None
    """Where oncoming traffic stops at the same lights."""
    opposed: bool
    """Whether oncoming traffic may only go while the ego's direction may not."""


def build_lines(route: Route) -> tuple[Line, ...]:
    """All lines in driving order."""
    span = route.section.span()
    lights = [
        Line(i, "light", i, each.at_m, opposite_line_m(route, each.at_m), _opposed(span, each.at_m))
        for i, each in enumerate(route.scenario.lights)
    ]
    stops = [Line(100 + i, "stop_line", i, stop.at_m, None, False) for i, stop in enumerate(route.scenario.stops)]
    yields = [
        Line(200 + i, "yield", i, each.at_m, opposite_line_m(route, each.at_m), False)
        for i, each in enumerate(route.scenario.yields)
    ]
    return tuple(sorted(lights + stops + yields, key=lambda line: line.at_m))


def _opposed(span: tuple[float, float] | None, at_m: float) -> bool:
    return span is not None and span[0] - 20.0 <= at_m <= span[1]


@dataclass(slots=True)
class Lights:
    """All lights as they run."""

    cycles: list[Cycle]
    time_s: float = 0.0

    def advance(self, time_s: float, lines: tuple[Line, ...], ego_front_m: float) -> None:
        """Move to a time; the ego's approach may begin a cycle."""
        self.time_s = time_s
        for line in lines:
            if line.kind == "light":
                self.cycles[line.ordinal] = self.cycles[line.ordinal].approached(time_s, line.at_m - ego_front_m)

    def state(self, line: Line, oncoming: bool = False) -> LightState:
        """What a direction sees at a line."""
        cycle = self.cycles[line.ordinal]
        return cycle.opposing(self.time_s) if oncoming and line.opposed else cycle.state(self.time_s)


@dataclass(slots=True)
class Stood:
    """Which driver has stood at which stop sign: driver's number to line key."""

    since_s: dict[tuple[int, int], float] = field(default_factory=dict)
    served: set[tuple[int, int]] = field(default_factory=set)

    def watch(self, who: int, line: Line, distance_m: float, speed_mps: float, time_s: float) -> bool:
        """Whether one may go on at a stop sign; call it every step."""
        key = (who, line.key)
        if -3.0 < distance_m < STANDS_WITHIN_M and speed_mps < STANDS_BELOW_MPS:
            since = self.since_s.setdefault(key, time_s)
            if time_s - since >= STANDS_FOR_S:
                self.served.add(key)
        return key in self.served


def must_stop(state: LightState, speed_mps: float, distance_m: float) -> bool:
    """Whether a light tells a driver that far away to stop: amber does only if there is room."""
    if state == "amber":
        return speed_mps * speed_mps / (2.0 * max(distance_m, 0.1)) < HARDEST_FOR_AMBER_MPS2
    return state in ("red", "red_amber")
