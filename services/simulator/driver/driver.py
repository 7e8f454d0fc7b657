"""The driver: follows by the intelligent driver model, reads signs imperfectly, obeys advice after the reaction time.

A lead is followed as it was a reaction time ago, taken to have driven on at that speed since; the own speed is the present
one (Treiber, Kesting and Helbing 2006, Physica A 360: reaction time and temporal anticipation).

An overlooked limit is noticed later: it is met again 500 m behind its sign, then every 900 m, and each time it is seen with
the probability of any sign. Distances are those of repeater signs in AS 1742.4 (2020), 3.1.6: at most 500 m behind a change,
then 0.8 to 1.0 km where the road suggests another speed. In a simulator 20 % of speed limit signs were not perceived, however
far apart (Inman et al. 2008, TRB 87th Annual Meeting). A limit whose sign the driver cannot read is learnt from the other cars
at the same places, which is ours.

Without advice the driver does what the driver alone has noticed and understood; that is what the assistant is for. Pure: the
view of the road and the time come in, a wish for acceleration goes out. SI units, seconds since the start.
"""

import zlib
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from domain.kinematics import GRAVITY_MPS2
from services.simulator.car.kinematics import FREE, following_mps2, free_road_mps2, stopping_mps2
from services.simulator.driver.profile import Attention, Dice, DriverProfile

NO_LIMIT_MPS = 130 / 3.6
GENTLE_MPS2 = -2.5
"""What the driver does without being startled; braking harder takes the reaction time first."""
ADVICE_HOLDS_S, WARNING_HOLDS_S = 25.0, 4.0
"""How long the driver keeps to what was said when it is not said again. The second is for a warning, and for a road user or a
place to give way at that the driver sees ahead: the driver sees such a hazard pass without help."""
WARNED_FACTOR, WARNED_FOR_S = 0.6, 3.0
"""A warned driver reacts in this share of the reaction time, for so long after the warning."""
ACCELERATION_MPS2, BRAKING_MPS2 = 1.7, 2.2
JERK_UP_MPS3, JERK_DOWN_MPS3, JERK_EMERGENCY_MPS3 = 3.0, 8.0, 30.0
SLOWEST_ADVICE_MPS = 2.0
SAME_LIMIT_MPS = 0.3
STAND_M = 2.5
REPEATED_AFTER_M, REPEATED_EVERY_M = 500.0, 900.0
"""Where an overlooked limit is met again."""
LOOKS_AWAY_FACTOR = 0.3
"""Ours: a driver who looks elsewhere notices a sign with this share of the probability."""
ENGINE_DRAG_MPS2 = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Advice:
    """A spoken message, as the driver hears it."""

    topic: str
    target_mps: float | None
    limit_mps: float | None = None
    """The limit in force, where the words tell it."""
    warns: bool = False
    """Whether it points out a hazard."""
    ahead_mps: float | None = None
    """A lower limit that it announces."""
    slow: bool = False
    """Whether it tells the driver to slow down to that limit, not only that the limit comes."""
    seen: bool = False
    """Whether the target is for a road user, or a place to give way at, that the driver sees ahead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StopAhead:
    """A line at which one has to stop now, and which one it is."""

    key: int
    distance_m: float
    missable: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class DriverView:
    """The road as it is for the driver; what to make of it is up to the driver."""

    time_s: float
    speed_mps: float
    mu: float
    wet: bool
    bend_mps: float = FREE
    sense_mps: float = FREE
    """The highest speed that drivers choose on a road that looks like this, signs or not."""
    gap_m: float | None = None
    lead_mps: float = 0.0
    stop: StopAhead | None = None
    person_m: float | None = None
    passed: tuple[tuple[int, float | None, bool], ...] = ()
    """Posts just passed: number, the limit that now holds, whether the driver can understand the sign."""
    car_brakes: bool = False
    """Whether the car brakes by itself, which the driver feels."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What the driver does: acceleration in m/s^2 and the pedals that go with it, 0 to 1."""

    acceleration_mps2: float
    accelerator: float
    brake: float


@dataclass(slots=True)
class _Standing:
    topic: str
    target_mps: float
    from_s: float
    until_s: float
    announces_mps: float | None = None
    """The limit ahead that it was said of, until its sign is passed."""
    warns: bool = False


class _Lead(NamedTuple):
    """A lead as it was seen."""

    time_s: float
    gap_m: float
    lead_mps: float
    way_m: float
    """The own way until then."""


@dataclass(slots=True)
class _Overlooked:
    """A limit whose sign was passed unseen, and where it is met again."""

    number: int
    limit_mps: float | None
    again_m: float
    times: int = 0


@dataclass(slots=True)
class Driver:
    """The driver's mind; `hear` and `drive` are all that is done to it."""

    profile: DriverProfile
    believed_mps: float | None
    """The limit that the driver believes in; None: no limit."""
    _standing: list[_Standing] = field(default_factory=list)
    _beliefs: list[tuple[float, float]] = field(default_factory=list)
    _noticed_s: dict[str, float] = field(default_factory=dict)
    _warned_s: float = -1e9
    _acceleration: float = 0.0
    _way_m: float = 0.0
    _leads: deque[_Lead] = field(default_factory=deque)
    _overlooked: _Overlooked | None = None
    _attention: Attention = field(init=False)
    _dice: Dice = field(init=False)

    def __post_init__(self) -> None:
        self._attention, self._dice = Attention(self.profile), Dice(self.profile.seed)

    def hear(self, advice: Advice, time_s: float) -> None:
        """A message is spoken; the driver acts on it, or not, after the reaction time."""
        acts_s = time_s + self.profile.reaction_s
        if advice.warns:
            self._warned_s = time_s
            self._hasten(time_s + WARNED_FACTOR * self.profile.reaction_s)
        if not self._complies(advice):
            return
        if advice.limit_mps is not None:
            self._beliefs.append((acts_s, advice.limit_mps))
        if advice.ahead_mps is not None:
            habit = 1.0 if advice.slow else self.profile.speed_bias
            self._stand_by(advice, advice.ahead_mps * habit, time_s, ADVICE_HOLDS_S)
        elif advice.target_mps is not None:
            holds_s = WARNING_HOLDS_S if advice.warns or advice.seen else ADVICE_HOLDS_S
            self._stand_by(advice, max(advice.target_mps, SLOWEST_ADVICE_MPS), time_s, holds_s)

    def drive(self, view: DriverView, dt: float) -> Wish:
        """The driver's next wish."""
        self._way_m += view.speed_mps * dt
        self._read_signs(view)
        self._take_over_beliefs(view.time_s)
        wanted = self._bounded(self._demand(view), view)
        jerk = JERK_EMERGENCY_MPS3 if wanted < -4.0 else JERK_DOWN_MPS3 if wanted < self._acceleration else JERK_UP_MPS3
        change = min(max(wanted - self._acceleration, -jerk * dt), jerk * dt)
        if (
            view.car_brakes
        ):  # the foot stays where it is, or brakes too: a driver does not accelerate against the brakes
            change = min(change, 0.0)
        self._acceleration += change
        return pedals(self._acceleration)

    def wanted_mps(self, view: DriverView) -> float:
        """The speed that the driver would drive on a free road."""
        own = (self.believed_mps or NO_LIMIT_MPS) * self.profile.speed_bias
        own *= self.profile.wet_slowdown if view.wet else 1.0
        told = [each.target_mps for each in self._heard_by(view.time_s)]
        return min([own, view.bend_mps, view.sense_mps, *told])

    def distracted(self, time_s: float) -> bool:
        """Whether the driver looks elsewhere."""
        return self._attention.distracted(time_s)

    # What the driver does about each thing -------------------------------------------------------------------------

    def _demand(self, view: DriverView) -> float:
        free = free_road_mps2(view.speed_mps, self.wanted_mps(view), ACCELERATION_MPS2)
        demands = [free, self._for_stop(view), self._for_person(view)]
        if view.gap_m is not None:
            demands.append(max(free, 0.0) + self._for_lead(view, view.gap_m))
        else:
            self._leads.clear()
        return min(demands)

    def _for_lead(self, view: DriverView, gap_m: float) -> float:
        self._leads.append(_Lead(view.time_s, gap_m, view.lead_mps, self._way_m))
        demand = self._follows(view.speed_mps, view.lead_mps, gap_m)
        if demand > GENTLE_MPS2:
            self._forget("lead", demand > -1.5)
        elif self._reacts("lead", view.time_s):
            return demand
        else:
            return max(self._follows_late(view), self.profile.unready_mps2)
        return self._follows_late(view)

    def _follows_late(self, view: DriverView) -> float:
        """By the lead as it was a reaction time ago."""
        while len(self._leads) > 1 and self._leads[1].time_s <= view.time_s - self.profile.reaction_s:
            self._leads.popleft()
        by_s = view.time_s - self._reaction_s(view.time_s)
        seen = next((each for each in reversed(self._leads) if each.time_s <= by_s), None)
        if seen is None:
            return 0.0
        gap_m = seen.gap_m + seen.lead_mps * (view.time_s - seen.time_s) - (self._way_m - seen.way_m)
        return self._follows(view.speed_mps, seen.lead_mps, gap_m)

    def _follows(self, speed_mps: float, lead_mps: float, gap_m: float) -> float:
        return following_mps2(
            speed_mps,
            lead_mps,
            gap_m,
            headway_s=self.profile.headway_s,
            stand_m=STAND_M,
            a_mps2=ACCELERATION_MPS2,
            b_mps2=BRAKING_MPS2,
        )

    def _for_stop(self, view: DriverView) -> float:
        if view.stop is None:
            return FREE
        key = f"stop{view.stop.key}"
        warned = self._warned_s > view.time_s - 10.0
        missed = view.stop.missable and self._dice.says(self.profile.misses_stop, 1, view.stop.key) and not warned
        if missed or not self._reacts(key, view.time_s):
            return FREE
        return stopping_mps2(view.speed_mps, view.stop.distance_m, 1.6)

    def _for_person(self, view: DriverView) -> float:
        if view.person_m is None:
            self._forget("person", True)
            return FREE
        if not self._reacts("person", view.time_s):
            return FREE
        return stopping_mps2(view.speed_mps, view.person_m - STAND_M, 0.5)

    def _bounded(self, demand: float, view: DriverView) -> float:
        limit = view.mu * GRAVITY_MPS2
        return min(max(demand, -limit, -self.profile.brakes_mps2), limit)

    # Noticing -------------------------------------------------------------------------------------------------------

    def _reacts(self, what: str, time_s: float) -> bool:
        """Whether the driver has noticed something and the reaction time is over; the first question starts it."""
        if what not in self._noticed_s:
            warned = self._warned(time_s)
            starts = time_s if warned else self._attention.back_on_the_road_s(time_s) + self.profile.glance_s
            self._noticed_s[what] = starts + self._reaction_s(time_s)
        return time_s >= self._noticed_s[what]

    def _warned(self, time_s: float) -> bool:
        return self._warned_s > time_s - WARNED_FOR_S

    def _reaction_s(self, time_s: float) -> float:
        return self.profile.reaction_s * (WARNED_FACTOR if self._warned(time_s) else 1.0)

    def _forget(self, what: str, over: bool) -> None:
        if over:
            self._noticed_s.pop(what, None)

    def _hasten(self, by_s: float) -> None:
        for what, at_s in self._noticed_s.items():
            self._noticed_s[what] = min(at_s, by_s)

    def _read_signs(self, view: DriverView) -> None:
        for number, limit_mps, understood in view.passed:
            looked_for = any(_same(each.announces_mps, limit_mps) for each in self._heard_by(view.time_s))
            if looked_for or (understood and self._notices(view.time_s, number)):
                self._read(limit_mps)
            else:
                self._overlooked = _Overlooked(number, limit_mps, self._way_m + REPEATED_AFTER_M)
        missed = self._overlooked
        if missed is not None and self._way_m >= missed.again_m:
            missed.times, missed.again_m = missed.times + 1, self._way_m + REPEATED_EVERY_M
            if self._notices(view.time_s, missed.number, missed.times):
                self._read(missed.limit_mps)

    def _notices(self, time_s: float, *sign: int) -> bool:
        chance = self.profile.notices * (LOOKS_AWAY_FACTOR if self.distracted(time_s) else 1.0)
        return self._dice.says(chance, 2, *sign)

    def _read(self, limit_mps: float | None) -> None:
        """A sign's limit holds for the driver from now on. What was said of the road so far is over, except for warnings
        and for what was announced of a sign still to be passed. The driver keeps to what was announced of this sign."""
        self.believed_mps, self._overlooked = limit_mps, None
        self._beliefs.clear()
        self._standing = [each for each in self._standing if each.warns or each.announces_mps is not None]
        for each in self._standing:
            if _same(each.announces_mps, limit_mps):
                each.announces_mps = None

    # Advice ---------------------------------------------------------------------------------------------------------

    def _complies(self, advice: Advice) -> bool:
        """The driver has one mind about each limit, and one about each other topic, all drive long: more messages convince no more."""
        limit_mps = advice.limit_mps if advice.ahead_mps is None else advice.ahead_mps
        about = advice.topic if limit_mps is None else f"limit {round(limit_mps * 3.6)}"
        return self._dice.says(self.profile.compliance, 3, zlib.crc32(about.encode()))

    def _heard_by(self, time_s: float) -> list[_Standing]:
        """What the driver was told and has in mind now."""
        return [each for each in self._standing if each.from_s <= time_s < each.until_s]

    def _stand_by(self, advice: Advice, target_mps: float, time_s: float, holds_s: float) -> None:
        """The topic's new word. The driver keeps to what the topic said before until the driver acts on the new word."""
        acts_s = time_s + self.profile.reaction_s
        mine = [each for each in self._standing if each.topic == advice.topic and each.until_s > acts_s]
        same = next((each for each in mine if abs(each.target_mps - target_mps) < 0.3), None)
        for each in mine:
            each.until_s = acts_s
        self._standing = [each for each in self._standing if each is not same and each.until_s > time_s]
        from_s = acts_s if same is None else min(same.from_s, acts_s)
        until_s = acts_s + holds_s
        self._standing.append(_Standing(advice.topic, target_mps, from_s, until_s, advice.ahead_mps, advice.warns))

    def _take_over_beliefs(self, time_s: float) -> None:
        for acts_s, limit_mps in [each for each in self._beliefs if each[0] <= time_s]:
            self.believed_mps = limit_mps
            self._beliefs.remove((acts_s, limit_mps))


def _same(announced_mps: float | None, limit_mps: float | None) -> bool:
    return announced_mps is not None and limit_mps is not None and abs(announced_mps - limit_mps) < SAME_LIMIT_MPS


def pedals(acceleration_mps2: float) -> Wish:
    """The pedals for an acceleration: the engine holds back a little by itself."""
    push = acceleration_mps2 + ENGINE_DRAG_MPS2
    return Wish(acceleration_mps2, min(max(push / 4.0, 0.0), 1.0), min(max(-push / 8.0, 0.0), 1.0))
