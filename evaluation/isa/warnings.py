"""The warning tests: an absent driver goes on at constant speed behind the sign of a lower limit."""

from collections.abc import Sequence

import msgspec

from evaluation.isa.accuracy import SHOWN_WITHIN_S
from proto.speed_assistance import SpeedAssistance
from proto.truth import Truth
from services.simulator.scenario.plan import (
    BendPlan,
    EgoPlan,
    RoadPlan,
    Scenario,
    SignPlan,
    StretchPlan,
    TrafficPlan,
    WeatherPlan,
)

LIMIT_KMH, SIGN_M, START_M = 50, 140.0, 20.0
SPEEDS_KMH = (51, 54, 57, 62, 67)
"""Within the tolerance, then in each band of the table of times."""
SECONDS = 24.0
VISUAL_S = 1.5
SOUND_S = ((65.0, 3.0), (60.0, 4.0), (55.0, 5.0), (52.5, 6.0))
"""Speed (km/h) -> latest sound after the overspeed began (3.5.2.1.4, with the tolerance of 3.2.3)."""
MOST_SOUND_S = 5.0


class Warned(msgspec.Struct, frozen=True, kw_only=True):
    """What was warned of in one test; times from the beginning of the overspeed, s. None: nothing was."""

    shown_s: float | None = None
    sounded_s: float | None = None
    sound_s: float = 0.0
    """How long it was sounded in all."""


def scenario(speed_kmh: int) -> Scenario:
    """A straight, empty road with the sign of the lower limit."""
    return Scenario(
        name=f"isa-{speed_kmh}",
        country="DEU",
        road=RoadPlan(
            bends=(BendPlan(length_m=1000.0),),
            stretches=(StretchPlan(from_m=0.0, road_class="rural", surroundings="fields"),),
        ),
        ego=EgoPlan(at_m=START_M, lane=0, speed_kmh=float(speed_kmh)),
        weather=(WeatherPlan(at_s=0.0),),
        traffic=TrafficPlan(forward=0, oncoming=0),
        signs=(SignPlan(at_m=5.0, codes=("limit:70",)), SignPlan(at_m=SIGN_M, codes=(f"limit:{LIMIT_KMH}",))),
    )


def warned(truths: Sequence[Truth], told: Sequence[tuple[float, SpeedAssistance]]) -> Warned:
    """Of a run; `told` by seconds since its start."""
    over = (each.time_s for each in truths if each.law_limit_mps is not None and each.speed_mps > each.law_limit_mps)
    began_s = next(over, None)
    if began_s is None:
        return Warned()
    since = [(time_s - began_s, each.warning) for time_s, each in told if time_s >= began_s]
    sounds = [time_s for time_s, warning in since if warning == "sounded"]
    return Warned(
        shown_s=next((time_s for time_s, warning in since if warning != "none"), None),
        sounded_s=next(iter(sounds), None),
        sound_s=len(sounds) * 0.1,
    )


def verdict(speed_kmh: int, found: Warned) -> str:
    """`passed`, or what the rule asks for; a limit may be shown 2 s after its sign."""
    latest_s = next((after_s for least, after_s in SOUND_S if speed_kmh > least), None)
    if latest_s is None:
        return "passed" if found.sounded_s is None else "sounded within the tolerance"
    if found.shown_s is None or found.shown_s > SHOWN_WITHIN_S + VISUAL_S:
        return "shown too late"
    if found.sounded_s is None or not latest_s - 0.1 <= found.sounded_s <= latest_s + SHOWN_WITHIN_S:
        return f"not sounded after {latest_s:g} to {latest_s + SHOWN_WITHIN_S:g} s"
    return "passed" if found.sound_s <= MOST_SOUND_S + 0.1 else "sounded for too long"
