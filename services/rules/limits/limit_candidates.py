"""What speaks for a limit here: signs in force, defaults of the law, caps that hold whatever a sign shows."""

import math
from collections.abc import Iterator
from typing import Literal

import msgspec

from domain.units import to_mps
from proto.rules import PostedLimit, Situation
from proto.scene import Unit
from services.rules.limits.conditions import Holds, holds, plate_holds, unknown_facts
from services.rules.packs.format import Advisory, Kind, Limit, Provision, Sign, When
from services.rules.packs.loading import Pack
from services.rules.signs.sign_codes import CANDIDATE_FLOOR, Reading, hours_of, parse_reading

Basis = Literal["posted", "gantry", "temporary", "zone", "conditional", "default", "cap", "advisory", "uncertain"]
TRUST = 0.5
"""A sign read with less than this confidence may lower the limit, never replace the road's default by a higher one."""
DEFAULT_CONFIDENCE = 0.9
"""Of a default of the law: a sign may have been missed."""
ADVISORY_CONFIDENCE = 0.8
CONTRADICTED_UNIT = 0.6
RANK: dict[str, int] = {"temporary": 4, "gantry": 3, "posted": 2, "zone": 1}
"""Which of several signs in force governs: temporary and gantry signs come before permanent ones."""
_SCOPE_BASIS: dict[str, Basis] = {
    "permanent": "posted", "gantry": "gantry", "temporary": "temporary", "when_wet": "conditional", "zone": "zone",
}  # fmt: skip
_CITED: dict[str, tuple[str, ...]] = {
    "posted": ("posted_limit", "sign_over_default"),
    "gantry": ("gantry_over_permanent", "gantry", "posted_limit"),
    "temporary": ("temporary_over_permanent", "posted_limit"),
    "conditional": ("plate:when_wet", "posted_limit"),
    "gantry_conditional": ("gantry_plate:when_wet", "plate:when_wet", "gantry"),
    "zone": ("zone",),
    "uncertain": ("posted_limit",),
}
_SPEEDS = frozenset({"limit", "led", "zone", "general", "school_limit", "limit_board"})
"""Codes of signs whose number is a limit."""
WET_PLATE = "plate:when_wet"
ALL_SCOPES = frozenset(_SCOPE_BASIS)
ENDED_BY: dict[str, frozenset[str]] = {
    "limit_end": frozenset({"permanent", "temporary", "when_wet", "gantry"}),
    "all_end": frozenset({"permanent", "temporary", "when_wet"}),
    "national": frozenset({"permanent", "temporary", "when_wet", "zone"}),
    "zone_end": frozenset({"zone"}),
    "general_end": frozenset({"permanent"}),
    "town_exit": frozenset({"permanent", "zone"}),
    "led:end": frozenset({"gantry", "when_wet"}),
    "led:blank": frozenset({"gantry"}),
    "border": ALL_SCOPES,
}
"""Which signs end limits of which scope; those with a number end that value only."""
ENDS_ITS_OWN = {"general_end": "general"}
"""Ends that lift only what was posted by one sign: Switzerland's "50 generell", not another 50."""


class LimitCandidate(msgspec.Struct, frozen=True, kw_only=True):
    """One reason for one limit."""

    value: float
    unit: Unit
    basis: Basis
    confidence: float
    provisions: tuple[str, ...] = ()
    sign: str = ""
    kind: Kind = "statute"
    replaces_default: bool = False
    presumed: tuple[str, ...] = ()
    why: str = ""

    @property
    def mps(self) -> float:
        """In SI."""
        return to_mps(self.value, self.unit)


def cited_for(pack: Pack, basis: str) -> tuple[str, ...]:
    """Ids of the provisions that say how a sign of this kind is to be read, the extending pack's own first."""
    wanted = _CITED.get(basis, ())
    return tuple(name for what in wanted for name in pack.says_how.get(what, ()))[:2]


def reads(pack: Pack, what: str) -> bool:
    """Whether the pack says how signs of this kind are to be read."""
    return what in pack.says_how


def posted_candidates(pack: Pack, situation: Situation) -> tuple[LimitCandidate, ...]:
    """Of every sign that is, or may be, in force."""
    zone = () if situation.zone is None else (_zone_as_posted(pack, situation.zone),)
    ended = tuple(parse_reading(text) for text in situation.ended)
    found = (
        _posted_candidate(pack, situation, limit, (*ended, *_ends_beside(situation, limit)))
        for limit in (*situation.posted, *zone)
    )
    return tuple(candidate for candidate in found if candidate is not None)


def law_candidates(pack: Pack, situation: Situation, *, caps: bool) -> tuple[LimitCandidate, ...]:
    """Of the limits the law itself sets: defaults that a sign replaces, or caps that hold beside every sign."""
    return tuple(
        _law_candidate(provision, effect.value, effect.unit, effect.when, situation, "cap" if caps else "default", held)
        for provision, effect, held in _applying(pack, situation)
        if isinstance(effect, Limit) and effect.cap == caps
    )


def advisory_candidates(pack: Pack, situation: Situation) -> tuple[LimitCandidate, ...]:
    """Of recommended speeds where no limit exists."""
    return tuple(
        _law_candidate(provision, effect.value, effect.unit, effect.when, situation, "advisory", held)
        for provision, effect, held in _applying(pack, situation)
        if isinstance(effect, Advisory)
    )


def misread_candidates(pack: Pack, situation: Situation) -> tuple[LimitCandidate, ...]:
    """Of every reading that a sign not read for certain may have, where that is plausible for the road."""
    low, high = _plausible(pack, situation)
    found = []
    for possible in situation.candidates:
        reading = parse_reading(possible.reading)
        if reading.code not in _SPEEDS or reading.value is None:
            continue
        if possible.confidence >= CANDIDATE_FLOOR and low <= reading.value <= high:
            candidate = _candidate(
                pack, reading.value, pack.manifest.units, "uncertain", _confidence(possible.confidence)
            )
            found.append(msgspec.structs.replace(candidate, sign=reading.code))
    return tuple(found)


def _applying(pack: Pack, situation: Situation) -> Iterator[tuple[Provision, Limit | Advisory, Holds]]:
    for provision, effect in pack.limits:
        if (held := holds(effect.when, situation)) != "no":
            shown = _posted_below(pack, situation, effect.when.posted_below)
            if shown != "no":
                yield provision, effect, "maybe" if "maybe" in (held, shown) else "yes"


def _posted_below(pack: Pack, situation: Situation, value: float | None) -> Holds:
    """Whether a sign shows less: surely where a trusted one is in force, maybe where one may be or a reading may say so.

    A sign that itself holds only when wet says nothing of the road's limit otherwise.
    """
    if value is None:
        return "yes"
    found = (candidate for candidate in posted_candidates(pack, situation) if candidate.basis != "conditional")
    below = [candidate for candidate in found if candidate.mps < to_mps(value, pack.manifest.units)]
    if any(candidate.replaces_default for candidate in below):
        return "yes"
    doubted = (c.mps < to_mps(value, pack.manifest.units) for c in misread_candidates(pack, situation))
    return "maybe" if below or any(doubted) else "no"


def _law_candidate(
    provision: Provision, value: float, unit: Unit, when: When, situation: Situation, basis: Basis, held: Holds
) -> LimitCandidate:
    return LimitCandidate(
        value=value,
        unit=unit,
        basis=basis,
        confidence=ADVISORY_CONFIDENCE if basis == "advisory" else DEFAULT_CONFIDENCE,
        provisions=(provision.id,),
        kind=provision.kind,
        presumed=_presumed(when, situation) if held == "maybe" else (),
        why=_why(when),
    )


def _presumed(when: When, situation: Situation) -> tuple[str, ...]:
    return unknown_facts(when, situation) or (("sign_here",) if when.posted_below is not None else ())


def _why(when: When) -> str:
    """The condition that a driver is told as the reason."""
    reasons = (
        ("visibility", when.visibility_below_m is not None),
        ("snow", when.snow is not None),
        ("wet", when.wet is not None),
        ("why_posted", when.posted_below is not None),
        ("novice", when.novice is not None),
        ("snow_chains", when.snow_chains is not None),
        ("why_lit", when.lit is not None),
        ("time", when.hours is not None or when.period is not None),
        ("why_vehicle", bool(when.vehicle_classes)),
        ("why_everywhere", not when.road_types),
    )
    return next((name for name, holds_so in reasons if holds_so), "why_road")


def _posted_candidate(
    pack: Pack, situation: Situation, limit: PostedLimit, ended: tuple[Reading, ...]
) -> LimitCandidate | None:
    if not math.isfinite(limit.value) or limit.value <= 0 or limit.scope == "end":
        return None
    held, presumed, ended_here = _plates(pack, situation, limit)
    if held == "no" or ended_here or any(_ends_it(end, limit) for end in ended):
        return None
    confidence, unit = _confidence(limit.confidence), limit.unit
    if unit != pack.manifest.units:  # a sign of this country has no other unit: one of the two is misread
        confidence, unit = confidence * CONTRADICTED_UNIT, "km/h"
    basis = _basis(pack, limit)
    candidate = _candidate(pack, limit.value, unit, basis, confidence)
    if warned := _only_warns(pack, limit):
        candidate = msgspec.structs.replace(candidate, provisions=(*candidate.provisions, *warned.provisions))
    if basis == "conditional" and (limit.scope == "gantry" or parse_reading(limit.reading).code == "led"):
        candidate = msgspec.structs.replace(candidate, provisions=cited_for(pack, "gantry_conditional"))
    return msgspec.structs.replace(
        candidate,
        replaces_default=held == "yes" and candidate.basis in RANK and confidence >= TRUST,
        presumed=presumed,
    )


def _candidate(pack: Pack, value: float, unit: Unit, basis: Basis, confidence: float) -> LimitCandidate:
    sign = {"zone": "zone", "gantry": "led"}.get(basis, "limit")
    return LimitCandidate(
        value=value,
        unit=unit,
        basis=basis,
        confidence=confidence,
        provisions=cited_for(pack, basis),
        sign=sign if sign in pack.signs else "limit",
        kind="sign_table",
    )


def _basis(pack: Pack, limit: PostedLimit) -> Basis:
    if _only_warns(pack, limit):
        return "posted" if limit.scope == "when_wet" else _SCOPE_BASIS[limit.scope]
    return "conditional" if _speaks_of_wet(limit) else _SCOPE_BASIS[limit.scope]


def _speaks_of_wet(limit: PostedLimit) -> bool:
    return limit.scope == "when_wet" or any(parse_reading(plate).code == WET_PLATE for plate in limit.plates)


def _only_warns(pack: Pack, limit: PostedLimit) -> Sign | None:
    """The plate about wet roads where the pack knows it as a warning, which restricts no limit to them."""
    sign = pack.signs.get(WET_PLATE)
    warns = sign is not None and sign.plate is None and _speaks_of_wet(limit)
    return sign if warns else None


def _plates(pack: Pack, situation: Situation, limit: PostedLimit) -> tuple[Holds, tuple[str, ...], bool]:
    texts = limit.plates + ((WET_PLATE,) if limit.scope == "when_wet" else ())
    held: list[Holds] = []
    presumed: list[str] = []
    for text in texts:
        code = "plate:time" if hours_of(text) else parse_reading(text).code
        sign = pack.signs.get(code) or pack.signs.get(f"plate:{text}")
        plate = sign.plate if sign else None
        if plate is not None and plate.type == "end":
            return "yes", (), _confidence(limit.confidence) >= TRUST
        held.append(plate_holds(plate, text, situation))
        if held[-1] == "maybe" and not _only_warns(pack, limit):
            presumed.append(_FACT_OF_PLATE.get(plate.type if plate else "", "plate_below"))
    return ("no" if "no" in held else "maybe" if "maybe" in held else "yes"), tuple(presumed), False


_FACT_OF_PLATE = {"wet": "wet", "vehicle": "vehicle", "hours": "time"}
"""The fact on which a plate's word hangs; of others the plate itself is what is unknown."""


def _ends_beside(situation: Situation, limit: PostedLimit) -> tuple[Reading, ...]:
    """What trusted ends among the posted limits lift: no sign that was seen later than they, or more surely."""
    least = max(TRUST, _confidence(limit.confidence))
    return tuple(
        Reading("limit_end", end.value)
        for end in situation.posted
        if end.scope == "end" and _confidence(end.confidence) >= least and end.age_s <= limit.age_s
    )


def _ends_it(end: Reading, limit: PostedLimit) -> bool:
    scopes = next((ENDED_BY[name] for name in end.names if name in ENDED_BY), frozenset())
    if end.code in ENDS_ITS_OWN and parse_reading(limit.reading).code != ENDS_ITS_OWN[end.code]:
        return False
    return limit.scope in scopes and end.value in (None, limit.value)


def _zone_as_posted(pack: Pack, value: float) -> PostedLimit:
    return PostedLimit(value=value, unit=pack.manifest.units, scope="zone")


def _plausible(pack: Pack, situation: Situation) -> tuple[float, float]:
    table = pack.manifest.plausible_limits
    if situation.road_type is not None and situation.road_type in table:
        return table[situation.road_type]
    return min(low for low, _ in table.values()), max(high for _, high in table.values())


def _confidence(value: float) -> float:
    return min(max(value, 0.0), 1.0) if math.isfinite(value) else 0.0
