"""The question to the Rules, made of what is believed; coarse, so that a stretch of road is one question."""

import hashlib
import math
from typing import Any, cast

import msgspec

from proto.rules import PostedLimit, RulesAnswer, SignMeaning, Situation
from proto.weather import Conditions
from services.orchestrator.signs.limits import ROAD_TYPES, RoadType, in_force
from services.orchestrator.state import State

VISIBILITY_STEPS_M = (2000.0, 1000.0, 500.0, 300.0, 200.0, 150.0, 100.0, 75.0, 50.0, 25.0, 0.0)
LAW_KNOWN = 0.4
"""Confidence from which the law is known well enough to be spoken of."""


def situation(state: State) -> Situation:
    """Limits in force, ends passed, road, wetness, sight; rounded to the careful side."""
    signs, conditions = state.signs, state.held.conditions
    road = state.world.environment.road_type
    segment = state.world.environment.segment_id
    posted = tuple(_coarse(limit.posted) for limit in in_force(signs))
    return Situation(
        jurisdiction=signs.jurisdiction.value if signs.jurisdiction is not None else None,
        road_type=cast(RoadType, road.value) if road is not None and road.value in ROAD_TYPES else None,
        posted=posted,
        # what was ended is out of `posted` already; a limit seen since must not fall to an end sign that came before it
        ended=() if posted else tuple(reading for reading in signs.ended if reading != "junction"),
        wet=conditions.wet if conditions is not None else None,
        visibility_m=_step(conditions.visibility_m if conditions is not None else None),
        snow=_snow(conditions),
        segment_id=segment.value if segment is not None else "",
        language=state.preferences.language,
        home_unit=state.preferences.unit,
    )


def _snow(conditions: Conditions | None) -> bool | None:
    """Whether it snows; what nobody knows is not taken for no."""
    if conditions is None or conditions.precipitation == "unknown":
        return None
    return conditions.precipitation == "snow"


def _coarse(posted: PostedLimit) -> PostedLimit:
    return msgspec.structs.replace(posted, age_s=0.0, confidence=int(posted.confidence * 20) / 20)


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


def sane_limit(answer: RulesAnswer | SignMeaning) -> bool:
    """A limit that a road can have, with a confidence that is one."""
    if not (math.isfinite(answer.confidence) and 0.0 <= answer.confidence <= 1.0):
        return False
    limit = answer.limit
    return limit is None or (math.isfinite(limit.value) and math.isfinite(limit.mps) and 1.0 <= limit.mps <= 45.0)
