"""People on foot: along the pavement, waiting at the kerb, crossing, or stepping out in front of the ego."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np
from msgspec.structs import replace

from services.simulator.scenario.plan import CrosserPlan, Scenario, WalkersPlan

Mode = Literal["walking", "waiting", "crossing", "done"]
PERSON_IDS = 500
"""Actor ids of pedestrians begin here."""
STEP_CYCLE_M = 1.5
"""Two steps."""
KERB_TO_WAITING_M, KERB_TO_WALKING_M = 0.5, 1.4
DONE_AFTER_M = 1.0
Kerb = Callable[[float], float]
"""|d| of the kerb at s."""


class Person(msgspec.Struct, frozen=True, kw_only=True):
    """One person at (s, d); speeds along s and d in m/s."""

    number: int
    look_seed: int
    height_m: float
    s_m: float
    d_m: float
    mode: Mode
    along_mps: float = 0.0
    across_mps: float = 0.0
    turn_back_m: tuple[float, float] = (0.0, 0.0)
    walked_m: float = 0.0
    plan: CrosserPlan | None = None
    goal_d_m: float = 0.0

    @property
    def crossing(self) -> bool:
        """Whether on the way over the road now."""
        return self.mode == "crossing" and (self.plan is None or self.plan.walks_up_m is None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What people look at before they step: where the ego is, and whether cars have red where they stand."""

    time_s: float
    ego_s_m: float
    cars_have_red: Callable[[float], bool]


def populate(scenario: Scenario, kerb: Kerb, near: Callable[[float], float], seed: int) -> tuple[Person, ...]:
    """All people at the start; `near(s)` is the sign of d on the side on which one drives."""
    chance = np.random.default_rng([seed, 11])
    people: list[Person] = []
    for walkers in scenario.walkers:
        for index in range(walkers.count):
            people.append(_walker(walkers, index, len(people), kerb, near, chance))
    for plan in scenario.crossers:
        people.append(_crosser(plan, len(people), kerb, near, chance))
    return tuple(people)


def step_person(person: Person, around: Surroundings, kerb: Kerb, dt: float) -> Person:
    """The person a moment later."""
    if person.mode == "walking":
        return _walk(person, kerb, dt)
    if person.mode == "waiting" and person.plan is not None and _goes(person.plan, around):
        return replace(person, mode="crossing", across_mps=_towards(person) * person.plan.walk_mps)
    return _cross(person, dt) if person.mode == "crossing" else person


def _goes(plan: CrosserPlan, around: Surroundings) -> bool:
    distance = plan.at_m - around.ego_s_m
    if plan.when_ego_within_m is not None:
        return 0.0 < distance <= plan.when_ego_within_m
    if plan.waits_for_light:
        return around.cars_have_red(plan.at_m)
    return plan.at_s is not None and around.time_s >= plan.at_s


def _towards(person: Person) -> float:
    return 1.0 if person.goal_d_m > person.d_m else -1.0


def _cross(person: Person, dt: float) -> Person:
    moved = replace(
        person, d_m=person.d_m + person.across_mps * dt, walked_m=person.walked_m + abs(person.across_mps) * dt
    )
    if (moved.goal_d_m - moved.d_m) * person.across_mps > 0.0:
        return moved
    if person.plan is not None and person.plan.walks_up_m is not None:
        return replace(moved, mode="waiting", across_mps=0.0, plan=None)
    reach = (person.s_m - 60.0, person.s_m + 60.0)
    return replace(moved, mode="walking", across_mps=0.0, along_mps=1.3, turn_back_m=reach)


def _walk(person: Person, kerb: Kerb, dt: float) -> Person:
    s = person.s_m + person.along_mps * dt
    low, high = person.turn_back_m
    along = abs(person.along_mps) if s <= low else -abs(person.along_mps) if s >= high else person.along_mps
    side = 1.0 if person.d_m > 0 else -1.0
    clear = max(abs(person.d_m), kerb(s) + KERB_TO_WAITING_M)
    return replace(
        person, s_m=s, d_m=side * clear, along_mps=along, walked_m=person.walked_m + abs(person.along_mps) * dt
    )


def _walker(
    plan: WalkersPlan, index: int, number: int, kerb: Kerb, near: Callable[[float], float], chance: np.random.Generator
) -> Person:
    s = float(chance.uniform(plan.from_m, plan.to_m))
    far = plan.side == "far" or (plan.side == "both" and index % 2 == 1)
    side = near(s) * (-1.0 if far else 1.0)
    waiting = plan.mode == "waiting"
    out = KERB_TO_WAITING_M if waiting else KERB_TO_WALKING_M + float(chance.uniform(-0.5, 0.5))
    pace = float(chance.uniform(0.9, 1.7)) * float(chance.choice([-1.0, 1.0]))
    return Person(
        number=number,
        look_seed=int(chance.integers(1, 10_000)),
        height_m=float(chance.uniform(1.5, 1.92)),
        s_m=s,
        d_m=side * (kerb(s) + out),
        mode="waiting" if waiting else "walking",
        along_mps=0.0 if waiting else pace,
        turn_back_m=(plan.from_m, max(plan.to_m, plan.from_m + 1.0)),
    )


def _crosser(
    plan: CrosserPlan, number: int, kerb: Kerb, near: Callable[[float], float], chance: np.random.Generator
) -> Person:
    side = near(plan.at_m) * (-1.0 if plan.side == "far" else 1.0)
    out = kerb(plan.at_m) + KERB_TO_WAITING_M
    crosses = plan.walks_up_m is None
    return Person(
        number=number,
        look_seed=int(chance.integers(1, 10_000)),
        height_m=float(chance.uniform(1.5, 1.92)),
        s_m=plan.at_m,
        d_m=side * (out + (plan.walks_up_m or 0.0)),
        mode="waiting",
        plan=plan,
        goal_d_m=-side * (out + DONE_AFTER_M) if crosses else side * out,
    )
