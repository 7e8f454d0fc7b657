"""The display of gantries: their programme, or less where traffic downstream is slow; never flickering."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from services.simulator.scenario.plan import GantryPlan, PanelStep

LOOKS_AHEAD_M = 450.0
HOLDS_S = 4.0
"""A panel keeps what it shows at least this long."""
_BY_SPEED_KMH = ((25.0, 60), (55.0, 80), (85.0, 100))
"""Below this speed of the slowest car downstream, at most this limit."""
CONGESTION_BELOW_KMH = 40.0
LEGIBLE_S, LEGIBLE_M = 4.0, 60.0
"""What a driver comes to within this time or way is not changed any more: it could not be read before it is passed."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A gantry's display: the code over every lane, the danger symbol beside (may be ""), and since when."""

    code: str
    symbol: str = ""
    since_s: float = -1e9
    lanes: tuple[str, ...] = ()
    """Lane signals, from the median outwards; "" or missing: the code."""

    def over(self, lane: int) -> str:
        """What stands over a lane."""
        return (self.lanes[lane] if lane < len(self.lanes) else "") or self.code


def programme(plan: GantryPlan, time_s: float) -> PanelStep:
    """What the programme says at a time."""
    return [step for step in plan.steps if step.at_s <= time_s or step is plan.steps[0]][-1]


def at_start(plan: GantryPlan) -> Shown:
    """The display before the first step."""
    step = programme(plan, 0.0)
    return Shown(step.code, lanes=step.lanes)


class Comes(NamedTuple):
    """The ego, by its front: how far it is from a gantry (negative: past it), and how fast."""

    room_m: float
    speed_mps: float

    @property
    def could_not_read(self) -> bool:
        """Whether a change now would come too late to be read."""
        return 0.0 <= self.room_m <= max(LEGIBLE_M, LEGIBLE_S * self.speed_mps)


def decide(plan: GantryPlan, shown: Shown, time_s: float, downstream_mps: Sequence[float], ego: Comes) -> Shown:
    """The display now, from the programme and the speeds of the cars up to ``LOOKS_AHEAD_M`` behind the gantry; held while the ego
    could not read another one."""
    if ego.could_not_read:
        return shown
    step = programme(plan, time_s)
    code, symbol = step.code, ""
    if plan.follow_traffic and downstream_mps:
        slowest_kmh = min(downstream_mps) * 3.6
        code = _lower(code, next((limit for below, limit in _BY_SPEED_KMH if slowest_kmh < below), None))
        symbol = "led:congestion" if slowest_kmh < CONGESTION_BELOW_KMH else ""
    if (code, symbol, step.lanes) == (shown.code, shown.symbol, shown.lanes) or time_s - shown.since_s < HOLDS_S:
        return shown
    return Shown(code, symbol, time_s, step.lanes)


def _lower(code: str, limit: int | None) -> str:
    number = code.partition(":")[2]
    if limit is None or (number.isdigit() and int(number) <= limit):
        return code
    return f"led:{limit}"
