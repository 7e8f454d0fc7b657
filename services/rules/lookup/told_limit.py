"""The one limit that a provision answers a question with; no limit where that depends on what the question does not say."""

from collections.abc import Set
from itertools import product
from typing import Any, get_args

import msgspec

from domain.units import legal_limit, to_mps
from proto.rules import LegalLimit, Situation
from services.rules.limits.conditions import unknown_facts
from services.rules.limits.precedence import decide
from services.rules.lookup.asked_facts import asked_facts, asks_minimum, excluded_roads, names_another_vehicle
from services.rules.packs.format import Advisory, Effect, Limit, RoadType, When
from services.rules.packs.loading import Pack
from services.rules.words import say

CLEAR_M = 1000.0
_FAIR: dict[str, Any] = {"wet": False, "snow": False, "visibility_m": CLEAR_M}
"""The weather that a question means which does not speak of it."""
_FACT_OF = {
    "why_vehicle": "vehicle", "why_posted": "sign_here", "why_lit": "lit", "why_road": "road", "why_everywhere": "road",
    "": "road",
}  # fmt: skip
"""The fact behind a reason; other reasons are facts themselves."""
_NOT_SAID = Situation(vehicle_class=None, snow_chains=None)


def told_limit(
    pack: Pack, effects: tuple[Effect, ...], query: str, jurisdiction: str | None, language: str
) -> tuple[LegalLimit | None, str]:
    """The limit, and on what it hangs in words. Never one above what the law sets for the case that the question states."""
    limits = [effect for effect in effects if isinstance(effect, Limit | Advisory)]
    if not limits or asks_minimum(query):
        return None, ""
    asked = asked_facts(query)
    if names_another_vehicle(query) and "vehicle_class" not in asked:
        return None, _depends({"vehicle"}, language)
    situation = _stated(pack, asked, jurisdiction)
    fitting = [each for each in limits if _speaks_of(each.when, situation)]
    if "vehicle_class" not in asked and not fitting:  # a provision about one class of vehicle answers for that class
        fitting = [
            each for each in limits if _speaks_of(msgspec.structs.replace(each.when, vehicle_classes=()), situation)
        ]
    words = _depends({name for each in limits for name in unknown_facts(each.when, _NOT_SAID)}, language)
    others = excluded_roads(query)
    fitting = [each for each in fitting if others.isdisjoint(each.when.road_types)]
    values = {(each.value, each.unit, isinstance(each, Advisory)) for each in fitting}
    if len(values) != 1:
        return None, words
    ((value, unit, advisory),) = values
    told = legal_limit(value, unit, advisory=advisory)
    lowered_by = {_lower(pack, told, each.when, situation) for each in fitting} - {""}
    if lowered_by:
        return None, _depends(lowered_by, language)
    return told, words if any(each.when.vehicle_classes for each in fitting) else ""


def governing(pack: Pack, effects: tuple[Effect, ...], query: str, jurisdiction: str | None) -> str:
    """The provision that sets the limit for the road, the part of the country and the facts that are asked about; empty: the one found
    may."""
    limits = [effect for effect in effects if isinstance(effect, Limit | Advisory)]
    asked = asked_facts(query)
    road, part = asked.get("road_type"), jurisdiction if jurisdiction and "-" in jurisdiction else None
    elsewhere = [each.when.subdivision is not None and each.when.subdivision != part for each in limits]
    other_road = [bool(each.when.road_types) and road not in each.when.road_types for each in limits]
    if road is None or not limits or asks_minimum(query) or names_another_vehicle(query):
        return ""
    found = decide(pack, _stated(pack, asked, jurisdiction)).candidate
    if found is None or not found.provisions:
        return ""
    of_part = any(
        effect.when.subdivision == part for each, effect in pack.limits if part and each.id in found.provisions
    )
    lower = found.mps < min(to_mps(each.value, each.unit) for each in limits) - 0.01
    return found.provisions[0] if all(other_road) or all(elsewhere) or of_part or lower else ""


def _stated(pack: Pack, asked: dict[str, Any], jurisdiction: str | None) -> Situation:
    here = jurisdiction if jurisdiction and jurisdiction.startswith(pack.manifest.jurisdiction) else None
    return Situation(jurisdiction=here or pack.manifest.jurisdiction, **{**_FAIR, **asked})


def _depends(facts: Set[str], language: str) -> str:
    named = ", ".join(say(name, language) for name in sorted(facts))
    return say("limit_depends", language, facts=named) if facts else ""


def _speaks_of(when: When, situation: Situation) -> bool:
    """Whether nothing but the kind of road is a condition of it, the vehicle's class, or the part of the country, and these are the
    asked ones."""
    here = when.subdivision if when.subdivision == situation.jurisdiction else None
    plain = When(
        road_types=when.road_types, vehicle_classes=when.vehicle_classes, announced=when.announced, subdivision=here
    )
    klass, road = situation.vehicle_class, situation.road_type
    of_road = road is None or not when.road_types or road in when.road_types
    return when == plain and of_road and (not when.vehicle_classes or klass in when.vehicle_classes)


def _lower(pack: Pack, told: LegalLimit, when: When, situation: Situation) -> str:
    """The name of a fact by which the law may set less than was found; empty: it sets no less."""
    asked = situation.vehicle_class
    classes = (asked,) if not when.vehicle_classes or asked in when.vehicle_classes else when.vehicle_classes
    roads = (situation.road_type,) if situation.road_type is not None else when.road_types or get_args(RoadType)
    for road, klass in product(roads, classes):
        found = decide(pack, msgspec.structs.replace(situation, road_type=road, vehicle_class=klass)).candidate
        if found is not None and found.mps < told.mps - 0.01:
            return found.presumed[0] if found.presumed else _FACT_OF.get(found.why, found.why)
    return ""
