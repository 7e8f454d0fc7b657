"""The question to the Rules, made of what is believed; coarse, so that a stretch of road is one question."""

import hashlib
import math
from typing import Any, cast

import msgspec

from proto.observed import value_of
from proto.rules import PostedLimit, RulesAnswer, SignMeaning, Situation
from services.orchestrator.observations.local_time import hour, local_time
from services.orchestrator.signs.limits import HOURS_PLATE, ROAD_TYPES, RoadType, in_force
from services.orchestrator.state import State

VISIBILITY_STEPS_M = (2000.0, 1000.0, 500.0, 300.0, 200.0, 150.0, 100.0, 75.0, 50.0, 25.0, 0.0)
LAW_KNOWN = 0.4
"""Confidence from which the law is known well enough to be spoken of."""


def situation(state: State) -> Situation:
    """Limits in force, ends passed, road, wetness, sight; rounded to the careful side."""
    signs, conditions, environment = state.signs, state.held.conditions, state.world.environment
    posted = tuple(_coarse(limit.posted) for limit in in_force(signs))
    asked = Situation(
        jurisdiction=state.place,
        road_type=cast(RoadType, state.road) if state.road in ROAD_TYPES else None,
        posted=posted,
        # what was ended is out of `posted` already; a limit seen since must not fall to an end sign that came before it
        ended=() if posted else tuple(reading for reading in signs.ended if reading != "junction"),
        segment_id=value_of(environment.segment_id) or "",
        # street lamps lower no limit on a road that a sign or a map puts outside towns
        lit=False if state.road in ROAD_TYPES and state.road not in ("urban", "living_street") else None,
        language=state.preferences.language,
        home_unit=state.preferences.unit,
        **msgspec.structs.asdict(state.preferences.vehicle),
    )
    if (local := local_time(state)) is not None:
        asked = msgspec.structs.replace(asked, time_of_day_h=hour(local), day=local.strftime("%m-%d"))
    if conditions is None:
        return asked
    snow = None if conditions.precipitation == "unknown" else conditions.precipitation == "snow"
    visibility_m = _step(conditions.visibility_m)
    return msgspec.structs.replace(asked, wet=conditions.wet, visibility_m=visibility_m, snow=snow)


def _coarse(posted: PostedLimit) -> PostedLimit:
    """Hours on a plate are not told: whatever the time, a limit below them counts while it is the lowest."""
    plates = tuple(HOURS_PLATE if each.startswith(HOURS_PLATE) else each for each in posted.plates)
    confidence = int(min(max(posted.confidence, 0.0), 1.0) * 20) / 20
    return msgspec.structs.replace(posted, age_s=0.0, confidence=confidence, plates=plates)


def _step(visibility_m: float | None) -> float | None:
    if visibility_m is None:
        return None
    return next((step for step in VISIBILITY_STEPS_M if visibility_m >= step), 0.0)


def key(arguments: dict[str, Any]) -> str:
    """SHA-256 of a question's arguments as canonical JSON."""
    return hashlib.sha256(msgspec.json.encode(arguments, order="deterministic")).hexdigest()


def situation_arguments(state: State) -> dict[str, Any]:
    """The arguments of `applicable_limit`."""
    arguments: dict[str, Any] = {"situation": msgspec.to_builtins(situation(state))}
    return arguments


def todays_key(state: State) -> str:
    """The key of `applicable_limit` as it would be asked now."""
    return key(situation_arguments(state))


def sane_limit(answer: RulesAnswer | SignMeaning) -> bool:
    """Whether limit and confidence are such as a road and an answer can have."""
    limit = answer.limit
    sane = limit is None or (math.isfinite(limit.value) and 1.0 <= limit.mps <= 45.0)
    return sane and 0.0 <= answer.confidence <= 1.0
