"""The ledger of a drive, for evaluation: limits broken, stop lines crossed, hazards, collisions."""

from dataclasses import dataclass, field, replace

from services.simulator.road.stop_lines import LineKind
from services.simulator.truth.hazards import Hazard

TOLERANCE_MPS = 3 / 3.6
SPEEDING_AFTER_S = 1.0
INFRACTIONS: dict[LineKind, str] = {"light": "red_light", "stop_line": "no_stop", "yield": "wrong_yield"}
"""Turns cannot be illegal: the route is given, and the ego never leaves it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LedgerEntry:
    """What is so at one step, and what it amounts to."""

    time_s: float = 0.0
    distance_m: float = 0.0
    limit_mps: float | None = None
    country: str = ""
    gap_m: float | None = None
    closing_mps: float | None = None
    hazards: tuple[Hazard, ...] = ()
    """Those that are on, the oldest first."""
    stop: tuple[LineKind, float] | None = None
    """The kind of line at which the ego has to stop or give way now, and how far its front is from it."""
    infraction: str = ""
    """The infraction that was completed in exactly this step."""
    infractions: int = 0
    speeding_s: float = 0.0
    collision: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossed:
    """The ego's front has crossed a line in this step."""

    kind: LineKind
    must_have_stopped: bool


@dataclass(slots=True)
class Ledger:
    """The running account."""

    fact: LedgerEntry = field(default_factory=LedgerEntry)
    _over_s: float = 0.0
    _speeding: bool = False

    def keep(
        self,
        *,
        time_s: float,
        dt: float,
        speed_mps: float,
        limit_mps: float | None,
        country: str,
        lead: tuple[float, float] | None,
        hazards: tuple[Hazard, ...],
        stop: tuple[LineKind, float] | None,
        crossed: Crossed | None,
        collision: bool,
    ) -> LedgerEntry:
        """Enter a step; `lead` is (gap, closing speed)."""
        infraction = self._line(crossed) or self._speed(dt, speed_mps, limit_mps)
        over = limit_mps is not None and speed_mps > limit_mps
        self.fact = replace(
            self.fact,
            time_s=time_s,
            distance_m=self.fact.distance_m + speed_mps * dt,
            limit_mps=limit_mps,
            country=country,
            gap_m=lead[0] if lead else None,
            closing_mps=lead[1] if lead else None,
            hazards=hazards,
            stop=stop,
            infraction=infraction,
            infractions=self.fact.infractions + bool(infraction),
            speeding_s=self.fact.speeding_s + (dt if over else 0.0),
            collision=self.fact.collision or collision,
        )
        return self.fact

    def _speed(self, dt: float, speed_mps: float, limit_mps: float | None) -> str:
        if limit_mps is None or speed_mps <= limit_mps + TOLERANCE_MPS:
            # An episode ends at the limit itself, so that hovering at the tolerance is one event.
            self._over_s = 0.0
            self._speeding = self._speeding and limit_mps is not None and speed_mps > limit_mps
            return ""
        self._over_s += dt
        if self._speeding or self._over_s < SPEEDING_AFTER_S:
            return ""
        self._speeding = True
        return "speeding"

    def _line(self, crossed: Crossed | None) -> str:
        if crossed is None or not crossed.must_have_stopped:
            return ""
        return INFRACTIONS[crossed.kind]
