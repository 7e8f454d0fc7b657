"""Keeping the books of what really happens: limits broken, lines run over, hazards begun, collisions. For evaluation."""

from dataclasses import dataclass, field, replace

TOLERANCE_MPS = 3 / 3.6
SPEEDING_AFTER_S = 1.0
STANDING_MPS = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Fact:
    """What is so at one step, and what it amounts to."""

    time_s: float = 0.0
    distance_m: float = 0.0
    limit_mps: float | None = None
    country: str = ""
    gap_m: float | None = None
    closing_mps: float | None = None
    hazard: str = ""
    hazard_onset_s: float | None = None
    infraction: str = ""
    """The infraction that was completed in this very step."""
    infractions: int = 0
    speeding_s: float = 0.0
    collision: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossed:
    """The ego's front has crossed a line in this step."""

    kind: str
    must_have_stopped: bool


@dataclass(slots=True)
class Books:
    """The running account."""

    fact: Fact = field(default_factory=Fact)
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
        hazard: tuple[str, float] | None,
        crossed: Crossed | None,
        collision: bool,
    ) -> Fact:
        """Enter a step; `lead` is (gap, closing speed), `hazard` is (kind, onset)."""
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
            hazard=hazard[0] if hazard else "",
            hazard_onset_s=hazard[1] if hazard else None,
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
        return "red_light" if crossed.kind == "light" else "no_stop"
