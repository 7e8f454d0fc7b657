"""Limits that begin ahead: numbers on signs, and the law's own limit behind a town sign, for which the Rules are asked."""

import math
from typing import Any, NamedTuple

from domain.units import to_mps
from proto.rules import SignMeaning
from proto.scene import Unit
from services.orchestrator.law import rules_question
from services.orchestrator.signs.limits import DISTANCE_PLATE, RESTRICTED_PLATES, SURE, WET_PLATE, may_be_ours
from services.orchestrator.state import SignAhead, State

PLACES = frozenset({"town_entry", "calm_street"})
"""Signs without a number behind which the law sets a lower limit."""


class LimitAhead(NamedTuple):
    """A limit that is believed and not yet passed."""

    sign: SignAhead
    value: float
    unit: Unit
    mps: float
    confidence: float
    law: SignMeaning | None = None
    """What says so, where the sign has no number."""


def limits_ahead(state: State) -> tuple[LimitAhead, ...]:
    """All of the own lane that may hold for a car, in the order in which the signs are remembered."""
    dry = surely(state, wet=False)
    signs = (sign for sign in state.signs.ahead if sign.believed and sign.own_lane)
    found = (_limit(state, sign) for sign in signs if may_be_ours(sign.scope, sign.plates, dry=dry))
    return tuple(limit for limit in found if limit is not None)


def binding_ahead(state: State) -> tuple[LimitAhead, ...]:
    """Those of them that are sure to hold for us right behind their sign."""
    return tuple(limit for limit in limits_ahead(state) if _binds(state, limit.sign))


def surely(state: State, *, wet: bool) -> bool:
    """Whether the road is known to be wet, or dry."""
    conditions = state.held.conditions
    return conditions is not None and conditions.wet is wet and conditions.confidence >= SURE


def _binds(state: State, sign: SignAhead) -> bool:
    """No plate restricts it, or to wet roads and it is wet."""
    plates = [plate for plate in sign.plates if plate.startswith((*RESTRICTED_PLATES, DISTANCE_PLATE))]
    if sign.scope != "when_wet":
        return not plates
    return all(plate.startswith(WET_PLATE) for plate in plates) and surely(state, wet=True)


def _limit(state: State, sign: SignAhead) -> LimitAhead | None:
    if sign.kind == "limit" and sign.value is not None and sign.scope != "end":
        unit: Unit = "km/h" if sign.unit is None or _behind_a_border(state, sign) else sign.unit
        return LimitAhead(sign, sign.value, unit, to_mps(sign.value, unit), sign.confidence)
    law = law_behind(state, sign)
    if law is None or law.limit is None:
        return None
    limit = law.limit
    return LimitAhead(sign, limit.value, limit.unit, limit.mps, min(sign.confidence, law.confidence), law)


def _behind_a_border(state: State, sign: SignAhead) -> bool:
    """Whether another country's sign stands before it: its number is read in this country's unit until then, and counts as
    the lower reading."""
    borders = (each for each in state.signs.ahead if each.believed and each.reading.startswith("border:"))
    ahead_m = sign.distance_m
    return ahead_m is not None and any(each.distance_m is not None and each.distance_m < ahead_m for each in borders)


def places_ahead(state: State) -> tuple[SignAhead, ...]:
    """Believed signs of a place, the nearest first."""
    found = [sign for sign in state.signs.ahead if sign.reading in PLACES and sign.believed and sign.own_lane]
    return tuple(sorted(found, key=lambda s: (s.distance_m if s.distance_m is not None else math.inf, s.track_id)))


def law_behind(state: State, sign: SignAhead) -> SignMeaning | None:
    """What the Rules said of this sign of a place, here; None: not asked yet, or nothing to go by."""
    law = state.held.place
    if (
        law is None
        or sign.reading not in PLACES
        or state.held.place_key != rules_question.key(sign_question(state, sign))
    ):
        return None
    return (
        law
        if law.limit is not None and law.confidence >= rules_question.LAW_KNOWN and rules_question.sane_limit(law)
        else None
    )


def sign_question(state: State, sign: SignAhead) -> dict[str, Any]:
    """The arguments of `interpret_sign`: what else a doubted sign may be, too, with confidences rounded down, so that a
    wavering one is the same question."""
    here = state.signs.jurisdiction
    others = () if sign.believed else sign.candidates
    return {
        "reading": sign.reading,
        "jurisdiction": here.value if here is not None else None,
        "language": state.preferences.language,
        "plates": list(sign.plates),
        "candidates": [
            {"reading": c.reading, "confidence": int(c.confidence * 10) / 10} for c in others if c.confidence > 0
        ],
        "home_unit": state.preferences.unit,
    }
