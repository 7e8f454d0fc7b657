"""Limits that begin ahead: numbers on signs, and the law's own limit behind a town sign, for which the Rules are asked."""

from typing import Any, NamedTuple

from domain.units import to_mps
from proto.rules import SignMeaning
from proto.scene import Unit
from services.orchestrator.law import rules_question
from services.orchestrator.signs.limits import (
    DISTANCE_PLATE,
    RESTRICTED_PLATES,
    SURE,
    WET_PLATE,
    borders,
    doubts_unit,
    hangs,
    may_be_ours,
    unit_and_side,
)
from services.orchestrator.state import SignAhead, State

PLACES = frozenset({"town_entry", "calm_street"})
"""Signs without a number behind which the law sets a lower limit."""

CLOSED = "led:lane_closed"
ONE_GANTRY_M = 30.0
"""Distances of panels on one gantry differ by less."""


class LimitAhead(NamedTuple):
    """A limit that is believed and not yet passed."""

    sign: SignAhead
    value: float
    unit: Unit
    mps: float
    confidence: float
    law: SignMeaning | None = None
    """What says so, where the sign has no number."""
    open_unit: bool = False
    """Whether a border before it, or other signs, leave open in which unit the number is; it counts as the lower reading."""


def limits_ahead(state: State) -> tuple[LimitAhead, ...]:
    """All of the own lane, and beside it where it is closed, that may hold for a car, in the order in which the signs are remembered."""
    dry = surely(state, wet=False)
    signs = (
        sign
        for sign in state.signs.ahead
        if _comes_to_us(state, sign) and may_be_ours(sign.scope, sign.plates, dry=dry)
    )
    return tuple(limit for sign in signs if (limit := _limit(state, sign)) is not None)


def _comes_to_us(state: State, sign: SignAhead) -> bool:
    """Whether it stands over the ego's lane, or beside a panel there that closes the lane: the ego will leave that lane, or a bend made it
    seem ours."""
    if sign.ours or not sign.believed:
        return sign.ours
    closed = (each for each in state.signs.ahead if each.ours and each.reading == CLOSED)
    return sign.head == "led" and any(abs(each.at_m - sign.at_m) <= ONE_GANTRY_M for each in closed)


def binding_ahead(state: State) -> tuple[LimitAhead, ...]:
    """Those of them that are sure to hold for the ego right behind their sign."""
    return tuple(limit for limit in limits_ahead(state) if _binds(state, limit.sign))


def surely(state: State, *, wet: bool) -> bool:
    """Whether the road is known to be wet, or dry."""
    conditions = state.held.conditions
    return conditions is not None and conditions.wet is wet and conditions.confidence >= SURE


def _binds(state: State, sign: SignAhead) -> bool:
    """Whether no plate restricts it, or only to wet roads and it is wet."""
    if sign.scope != "when_wet":
        return not hangs(sign.plates, *RESTRICTED_PLATES, DISTANCE_PLATE)
    others = tuple(plate for plate in sign.plates if not plate.startswith(WET_PLATE))
    return not hangs(others, *RESTRICTED_PLATES, DISTANCE_PLATE) and surely(state, wet=True)


def _limit(state: State, sign: SignAhead) -> LimitAhead | None:
    if sign.kind == "limit" and sign.value is not None and sign.scope != "end":
        open_unit = _in_another_unit(state, sign) or doubts_unit(state.signs)
        unit: Unit = "km/h" if sign.unit is None or open_unit or _behind_a_border(state, sign) else sign.unit
        return LimitAhead(sign, sign.value, unit, to_mps(sign.value, unit), sign.confidence, None, open_unit)
    law = _law_behind(state, sign)
    if law is None or law.limit is None:
        return None
    limit = law.limit
    return LimitAhead(sign, limit.value, limit.unit, limit.mps, min(sign.confidence, law.confidence), law)


def _behind_a_border(state: State, sign: SignAhead) -> bool:
    """Whether another country's sign stands before it: its unit is not known yet, and its number counts as the lower reading."""
    return sign.distance_m is not None and any(each.at_m < sign.at_m for each in borders(state.signs))


def _in_another_unit(state: State, sign: SignAhead) -> bool:
    """Whether it is read in another unit than that of the country, or of one behind a border before it."""
    before = (each.reading.partition(":")[2] for each in borders(state.signs) if each.at_m < sign.at_m)
    return any(unit_and_side(country)[0] != (sign.unit or "km/h") for country in (state.signs.country, *before))


def places_ahead(state: State) -> tuple[SignAhead, ...]:
    """Believed signs of a place, the nearest first."""
    found = (sign for sign in state.signs.ahead if sign.ours and sign.reading in PLACES)
    return tuple(sorted(found, key=lambda sign: (sign.at_m, sign.track_id)))


def _law_behind(state: State, sign: SignAhead) -> SignMeaning | None:
    """What the Rules said of this sign of a place, here; None: not asked yet, or nothing to go by."""
    law = state.held.place
    if law is None or sign.reading not in PLACES or law.confidence < rules_question.LAW_KNOWN:
        return None
    asked = state.held.place_key == rules_question.key(sign_question(state, sign))
    return law if asked and rules_question.sane_limit(law) else None


def sign_question(state: State, sign: SignAhead) -> dict[str, Any]:
    """The arguments of `interpret_sign`; confidences are rounded down, so that a wavering one is the same question."""
    others = () if sign.believed else sign.candidates
    return {
        "reading": sign.reading,
        "jurisdiction": state.place,
        "language": state.preferences.language,
        "plates": list(sign.plates),
        "candidates": [
            {"reading": c.reading, "confidence": int(c.confidence * 10) / 10} for c in others if c.confidence > 0
        ],
        "home_unit": state.preferences.unit,
        "vehicle_class": state.preferences.vehicle.vehicle_class,
    }
