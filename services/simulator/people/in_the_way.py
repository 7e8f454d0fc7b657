"""Pedestrians in a vehicle's way, now or soon."""

from collections.abc import Iterable

from services.simulator.people.pedestrians import Person

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
    """Whether a person that crosses is in a lane, or will be within ``SOON_S``."""
    beside = lane_d_m - person.d_m
    if abs(beside) <= CORRIDOR_HALF_M:
        return True
    return beside * person.across_mps > 0.0 and (abs(beside) - CORRIDOR_HALF_M) / abs(person.across_mps) < SOON_S
