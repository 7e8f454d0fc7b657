"""The warning tests: an absent driver goes on at constant speed behind the sign of a lower limit, or accelerates through that limit.

Regulation (EU) 2021/1958, Annex I, times the sound at constant speed alone, as far as we know it (docs/how-to/evaluation.md). In
acceleration the same table is asked: a band's time runs from the instant at which the speed enters it.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import msgspec

from evaluation.isa.accuracy import SHOWN_WITHIN_S
from evaluation.isa.straight import straight
from proto.speed_assistance import SpeedAssistance
from proto.truth import Truth
from services.simulator.scenario.plan import EgoPlan, Scenario, SignPlan

LIMIT_KMH, SIGN_M, START_M = 50, 140.0, 20.0
SPEEDS_KMH = (51, 54, 57, 62, 67)
"""Within the tolerance, then in each band of the table of times."""
ACCELERATIONS_MPS2 = (0.5, 1.0, 2.0)
"""Ours: a gentle, a usual and a brisk one."""
AT_SIGN_KMH, ROOM_M = 40.0, 30.0
"""In acceleration the sign is passed at this speed, so far from the start."""
SECONDS = 24.0
VISUAL_S = 1.5
SOUND_S = ((65.0, 3.0), (60.0, 4.0), (55.0, 5.0), (52.5, 6.0))
"""Speed (km/h) -> latest sound after the overspeed began (3.5.2.1.4, with the tolerance of 3.2.3)."""
SHARES = ((1.3, 3.0), (1.2, 4.0), (1.1, 5.0), (1.0, 6.0))
TOLERANCE_SHARE, TOLERANCE_MPS = 1.03, 1.0 / 3.6
"""The same of any limit, and what no sound is due below."""
MOST_SOUND_S = 5.0
LATE_S = 0.3
"""Three ticks: what the car's own speed may lag behind the true one."""


class WarningTest(NamedTuple):
    """One warning test: at this speed, or from the sign on with this acceleration."""

    speed_kmh: float
    accelerates_mps2: float = 0.0

    @property
    def name(self) -> str:
        """`67`, or `40+1.0` in acceleration."""
        return f"{self.speed_kmh:g}" + (f"+{self.accelerates_mps2:g}" if self.accelerates_mps2 else "")


TESTS = (*(WarningTest(each) for each in SPEEDS_KMH), *(WarningTest(AT_SIGN_KMH, each) for each in ACCELERATIONS_MPS2))


def test_of(name: str) -> WarningTest:
    """The test of a name."""
    speed, _, acceleration = name.partition("+")
    return WarningTest(float(speed), float(acceleration or 0.0))


class Warned(msgspec.Struct, frozen=True, kw_only=True):
    """What was warned of in one overspeed; times from its beginning, s. None: nothing was."""

    shown_s: float | None = None
    sounded_s: float | None = None
    sound_s: float = 0.0
    """How long it was sounded in all."""
    due_s: float | None = None
    """When the table of times wants the sound, by the course of the speed; None: it wants none."""


def scenario(test: WarningTest) -> Scenario:
    """A straight, empty road with the sign of the lower limit."""
    at_m, speed_kmh = START_M, test.speed_kmh
    if test.accelerates_mps2:
        at_m = SIGN_M - ROOM_M
        speed_kmh = 3.6 * math.sqrt((AT_SIGN_KMH / 3.6) ** 2 - 2.0 * test.accelerates_mps2 * ROOM_M)
    return straight(
        test.name.replace("+", "-").replace(".", ""),
        EgoPlan(at_m=at_m, lane=0, speed_kmh=speed_kmh, absent_mps2=test.accelerates_mps2),
        signs=(SignPlan(at_m=5.0, codes=("limit:70",)), SignPlan(at_m=SIGN_M, codes=(f"limit:{LIMIT_KMH}",))),
    )


class Moment(NamedTuple):
    """Speed and limit at an instant."""

    time_s: float
    speed_mps: float
    limit_mps: float | None


def of_truth(truths: Sequence[Truth]) -> list[Moment]:
    """The course by truth."""
    return [Moment(each.time_s, each.speed_mps, each.law_limit_mps) for each in truths]


def overspeeds(course: Sequence[Moment]) -> Iterator[list[Moment]]:
    """Stretches above one limit, each up to where it is kept again or another one begins."""
    for limit_mps, stretch in groupby(course, _exceeded_mps):
        if limit_mps is not None:
            yield list(stretch)


def _exceeded_mps(now: Moment) -> float | None:
    return now.limit_mps if now.limit_mps is not None and now.speed_mps > now.limit_mps else None


def warned(course: Sequence[Moment], told: Sequence[tuple[float, SpeedAssistance]]) -> Warned:
    """Of the first overspeed of a course; `told` by the same seconds."""
    over = next(overspeeds(course), None)
    return Warned() if over is None else of_overspeed(over, told)


def of_overspeed(over: Sequence[Moment], told: Sequence[tuple[float, SpeedAssistance]]) -> Warned:
    """What was warned of in one overspeed."""
    began_s, end_s = over[0].time_s, over[-1].time_s
    since = [(time_s - began_s, each.warning) for time_s, each in told if began_s <= time_s <= end_s]
    sounds = [time_s for time_s, warning in since if warning == "sounded"]
    return Warned(
        shown_s=next((time_s for time_s, warning in since if warning != "none"), None),
        sounded_s=next(iter(sounds), None),
        sound_s=len(sounds) * 0.1,
        due_s=_due_s(over),
    )


def _due_s(over: Sequence[Moment]) -> float | None:
    """The earliest of the bands: each from where the speed entered it for as long as it stays."""
    return min((due for share, after_s in SHARES if (due := _due_in(over, share, after_s)) is not None), default=None)


def _due_in(over: Sequence[Moment], share: float, after_s: float) -> float | None:
    entered_s: float | None = None
    for each in over:
        limit_mps = each.limit_mps or 0.0
        if each.speed_mps <= max(share * limit_mps, TOLERANCE_SHARE * limit_mps + TOLERANCE_MPS):
            entered_s = None
            continue
        entered_s = each.time_s if entered_s is None else entered_s
        if each.time_s - entered_s >= after_s - 1e-6:
            return each.time_s - over[0].time_s
    return None


def verdict(test: WarningTest, found: Warned) -> str:
    """`passed`, or what the rule asks for; a limit may be shown 2 s after its sign."""
    if test.accelerates_mps2:
        return judged(found, SHOWN_WITHIN_S)
    latest_s = next((after_s for least, after_s in SOUND_S if test.speed_kmh > least), None)
    return judged(msgspec.structs.replace(found, due_s=latest_s), SHOWN_WITHIN_S)


def judged(found: Warned, known_after_s: float = 0.0) -> str:
    """`passed`, or what the rule asks for, of an overspeed whose limit may become known so long after it began."""
    if found.due_s is None:
        return "passed" if found.sounded_s is None else "sounded, and no sound is due"
    if found.shown_s is None or found.shown_s > known_after_s + VISUAL_S:
        return "shown too late"
    if found.sounded_s is None or not found.due_s - LATE_S <= found.sounded_s <= found.due_s + known_after_s + LATE_S:
        until = f" to {found.due_s + known_after_s:.1f}" if known_after_s else ""
        return f"not sounded after {found.due_s:.1f}{until} s"
    return "passed" if found.sound_s <= MOST_SOUND_S + 0.1 else "sounded for too long"
