"""People in a vehicle's way, and which hazards are on for the ego: truth, and what drivers may see."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from services.simulator.people.pedestrians import Person
from services.simulator.scene.body import Box

CORRIDOR_HALF_M = 1.7
SOON_S = 2.2
LOOKS_M = 70.0


def person_ahead_m(
    people: Iterable[Person], front_s_m: float, lane_d_m: float, forward: bool, reach_m: float = LOOKS_M
) -> float | None:
    """Distance from a vehicle's front to the nearest person who is in its corridor or will be soon."""
    nearest: float | None = None
    for person in people:
        if not person.crossing:
            continue
        ahead = person.s_m - front_s_m if forward else front_s_m - person.s_m
        if -0.5 < ahead < reach_m and enters(person, lane_d_m) and (not nearest or ahead < nearest):
            nearest = max(ahead, 0.05)
    return nearest


def enters(person: Person, lane_d_m: float) -> bool:
    """Whether somebody who crosses is in a lane, or will be within ``SOON_S``."""
    beside = lane_d_m - person.d_m
    if abs(beside) <= CORRIDOR_HALF_M:
        return True
    return beside * person.across_mps > 0.0 and (abs(beside) - CORRIDOR_HALF_M) / abs(person.across_mps) < SOON_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Peril:
    """Something that is or may become a hazard now; `key` tells it from all others of the drive."""

    kind: str
    key: int
    distance_m: float
    """From the ego's front; behind it negative."""
    begins: bool
    """The truth has crossed the event's threshold."""
    body: Box | None = None
    """What has to be in sight; None: nothing to see, one feels it."""
    actor_id: int | None = None
    lit: bool = False
    """Carries light of its own, or is lit by the road's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hazard:
    """A hazard that is on."""

    kind: str
    onset_s: float
    actor_id: int | None
    distance_m: float


@dataclass(slots=True)
class HazardLog:
    """Hazards from their onset until they are over; none comes twice."""

    _since: dict[tuple[str, int], float] = field(default_factory=dict)
    _over: set[tuple[str, int]] = field(default_factory=set)

    def note(self, perils: Iterable[Peril], in_sight: Callable[[Peril], bool], time_s: float) -> tuple[Hazard, ...]:
        """The hazards that are on, oldest first. One begins when its threshold is crossed and it is in sight."""
        now = {(peril.kind, peril.key): peril for peril in perils}
        self._over |= self._since.keys() - now.keys()
        for key, peril in now.items():
            if key not in self._since and peril.begins and in_sight(peril):
                self._since[key] = time_s
        on = [(self._since[key], peril) for key, peril in now.items() if key in self._since and key not in self._over]
        on.sort(key=lambda item: (item[0], item[1].kind, item[1].key))
        return tuple(
            Hazard(kind=each.kind, onset_s=since, actor_id=each.actor_id, distance_m=each.distance_m)
            for since, each in on
        )
