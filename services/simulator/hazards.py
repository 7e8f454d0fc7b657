"""People in a vehicle's way, and which hazard is on for the ego: truth, and what drivers may see."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from services.simulator.people import Person

CORRIDOR_HALF_M = 1.7
SOON_S = 2.2
LOOKS_M = 70.0
QUEUE_SEEN_M = 200.0


def person_ahead_m(
    people: Iterable[Person], front_s_m: float, lane_d_m: float, forward: bool, reach_m: float = LOOKS_M
) -> float | None:
    """Distance from a vehicle's front to the nearest person who is in its corridor or will be soon."""
    nearest: float | None = None
    for person in people:
        ahead = person.s_m - front_s_m if forward else front_s_m - person.s_m
        if person.crossing and -0.5 < ahead < reach_m and enters(person, lane_d_m) and (not nearest or ahead < nearest):
            nearest = max(ahead, 0.05)
    return nearest


def enters(person: Person, lane_d_m: float) -> bool:
    """Whether somebody who crosses is in a lane, or will be within ``SOON_S``."""
    beside = lane_d_m - person.d_m
    if abs(beside) <= CORRIDOR_HALF_M:
        return True
    return beside * person.across_mps > 0.0 and (abs(beside) - CORRIDOR_HALF_M) / abs(person.across_mps) < SOON_S


@dataclass(slots=True)
class HazardLog:
    """The hazard that is on: the first one begun that is not over."""

    _on: dict[str, float] = field(default_factory=dict)

    def note(self, present: Iterable[str], time_s: float) -> tuple[str, float] | None:
        """Enter which hazards are present now; the oldest with its onset, or None."""
        now = set(present)
        self._on = {kind: onset for kind, onset in self._on.items() if kind in now}
        for kind in sorted(now):
            self._on.setdefault(kind, time_s)
        return min(self._on.items(), key=lambda item: (item[1], item[0]), default=None)
