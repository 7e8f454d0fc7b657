"""Traffic lights: a cycle in time, begun by a car that approaches where the scenario says so."""

from dataclasses import dataclass

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
