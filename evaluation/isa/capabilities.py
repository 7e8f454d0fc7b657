"""Which special limits are understood: short drives of an absent driver past one post each, in Germany.

A capability counts where the right limit is shown from 2 s behind the post on, in every drive of it. Names are those of Euro
NCAP's sheet. Not driven, for the simulator has no such signs: snow, limits that begin or end after a distance, arrows over single
lanes, hours at which a limit holds.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from evaluation.isa.accuracy import SHOWN_WITHIN_S, shown
from evaluation.isa.straight import straight
from evaluation.metrics.law import same_limit
from evaluation.metrics.record import Record
from services.simulator.scenario.plan import EgoPlan, GantryPlan, PanelStep, RoadClass, Scenario, SignPlan

POST_M, START_M, SECONDS = 140.0, 20.0, 14.0
RAIN, ARROWS, CLASSES = (
    f"Conditional speed limits - {each}"
    for each in ("Rain / Wetness", "Non-lane relevant arrows", "Vehicle categories")
)
IMPLICIT = "Implicit speed limits - Highway, city and residential zones"
DYNAMIC, DYNAMIC_LANES = (f"Dynamic speed limits - {each}" for each in ("Non-lane relevant", "Lane relevant"))


class Drive(NamedTuple):
    """One drive past a post."""

    capability: str
    codes: tuple[str, ...] = ()
    rain_mm_h: float = 0.0
    led: str = ""
    """What a gantry shows in place of a post."""
    other_lane: str = ""
    """What it shows over the other lane."""
    road_class: RoadClass = "rural"
    speed_kmh: float = 60.0


DRIVES: Mapping[str, Drive] = MappingProxyType(
    {
        "wet": Drive(RAIN, ("limit:70", "plate:when_wet:de"), rain_mm_h=4.0),
        "dry": Drive(RAIN, ("limit:70", "plate:when_wet:de")),
        "arrow": Drive(ARROWS, ("limit:50", "plate:arrow_right")),
        "lorries": Drive(CLASSES, ("limit:60", "plate:lorries")),
        "town": Drive(IMPLICIT, ("town_entry",), speed_kmh=50.0),
        "town-exit": Drive(IMPLICIT, ("town_exit",), road_class="urban", speed_kmh=50.0),
        "motorway": Drive(IMPLICIT, ("motorway",)),
        "zone": Drive(IMPLICIT, ("zone:30",), road_class="urban", speed_kmh=50.0),
        "gantry": Drive(DYNAMIC, led="led:80", road_class="motorway", speed_kmh=80.0),
        "gantry-lanes": Drive(DYNAMIC_LANES, led="led:80", other_lane="led:60", road_class="motorway", speed_kmh=80.0),
    }
)


def scenario(name: str) -> Scenario:
    """A straight, empty road with that post."""
    drive = DRIVES[name]
    panel = PanelStep(at_s=0.0, code=drive.led, lanes=("", drive.other_lane) if drive.other_lane else ())
    return straight(
        name,
        EgoPlan(at_m=START_M, lane=0, speed_kmh=drive.speed_kmh),
        signs=(SignPlan(at_m=POST_M, codes=drive.codes),) if drive.codes else (),
        gantries=(GantryPlan(at_m=POST_M, steps=(panel,), follow_traffic=False),) if drive.led else (),
        road_class=drive.road_class,
        rain_mm_h=drive.rain_mm_h,
    )


def understood(record: Record) -> bool:
    """Whether the right limit is shown from 2 s behind the post on, to the end."""
    passed_s = next((each.time_s for each in record.truths if each.distance_m >= POST_M - START_M), None)
    if passed_s is None:
        return False
    behind = [(truth, held) for truth, held in shown(record) if truth.time_s >= passed_s + SHOWN_WITHIN_S]
    return bool(behind) and all(same_limit(held, truth.law_limit_mps) for truth, held in behind)


def capabilities(found: Mapping[str, bool]) -> dict[str, bool]:
    """By the sheet's names: whether all drives of each are there and understood; `found` by the drives' names."""
    wanted: dict[str, list[bool]] = {}
    for name, drive in DRIVES.items():
        wanted.setdefault(drive.capability, []).append(found.get(name, False))
    return {capability: all(each) for capability, each in wanted.items()}
