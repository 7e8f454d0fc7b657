"""What a sign means here, in the driver's language; a sign of another country is explained as one."""

import re
from collections.abc import Sequence

import msgspec

from domain.languages import spoken_language
from domain.units import legal_limit, spoken, spoken_converted
from proto.rules import LegalAction, LegalLimit, SignMeaning, VehicleClass
from proto.scene import Candidate, Unit
from services.rules.book import STALE, UNKNOWN_COUNTRY, UNKNOWN_PART, RuleBook, is_fallback, normal_jurisdiction
from services.rules.citing import cite_ids, cite_sign, cited_in_doubt, unique
from services.rules.packs.format import Limit, Sign, When
from services.rules.packs.loading import Pack
from services.rules.signs.sign_codes import CANDIDATE_FLOOR, Reading, parse_reading
from services.rules.signs.vehicle_signs import BINDINGS, Binding
from services.rules.words import country, named_packs, say, text_in

FOREIGN_SIGN = 0.5
"""Factor for a sign that only the table of another country has."""
UNUSUAL_VALUE = 0.5
PRESUMED = 0.8
"""Factor where a sign is taken to bind the vehicle, which is not known."""
SHOWN = (5.0, 140.0)
"""What a sign can show as a limit, in its own unit; any other number is not a limit."""
CAREFUL: tuple[LegalAction, ...] = (
    "stop", "no_entry", "yield", "reduce_speed", "comply_with_limit", "no_overtaking", "proceed_with_care", "unknown",
    "none", "proceed",
)  # fmt: skip
"""Actions, the most careful first."""


_EVERYBODY = Binding(action="none")
_CODE = re.compile(r"[A-Za-z_]{1,24}(?::[A-Za-z0-9_.]{1,16}){0,2}")
"""Of this form are the readers' codes; a text of another form is not repeated to the driver."""


class SignQuestion(msgspec.Struct, frozen=True, kw_only=True):
    """A sign as read, where, and for whom."""

    reading: str
    jurisdiction: str | None = None
    language: str = "en"
    plates: tuple[str, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    home_unit: Unit = "km/h"
    vehicle_class: VehicleClass | None = "car"
    """None: not known."""


def interpret_sign(book: RuleBook, question: SignQuestion) -> SignMeaning:
    """The meaning of the most careful reading that is a candidate; without candidates of the reading itself."""
    readings = _readings(question)
    meanings = [_interpret(book, question, reading) for reading, _ in readings]
    chosen = min(range(len(meanings)), key=lambda index: (_care(meanings[index]), -readings[index][1]))
    meaning, confidence = meanings[chosen], readings[chosen][1]
    cited = unique(citation for at in (chosen, *range(len(meanings))) for citation in meanings[at].citations)
    others = [
        _without_place(book, reading, question.language)
        for index, (reading, _) in enumerate(readings)
        if index != chosen and _CODE.fullmatch(reading)
    ]
    note = " ".join([meaning.note, say("maybe_sign", question.language, others=", ".join(others)) if others else ""])
    sure = meaning.confidence * min(1.0, max(0.0, confidence))
    return msgspec.structs.replace(meaning, confidence=sure, note=note.strip(), citations=cited)


def _without_place(book: RuleBook, reading: str, language: str) -> str:
    """A code as readers write it; of a border the country's name."""
    head, _, place = reading.partition(":")
    return country(book, place.upper(), language) if head == "border" else reading


def careful_rank(action: LegalAction) -> int:
    """0 for the most careful action."""
    return CAREFUL.index(action)


def _readings(question: SignQuestion) -> list[tuple[str, float]]:
    found = {c.reading: c.confidence for c in question.candidates if c.confidence >= CANDIDATE_FLOOR}
    return list(found.items()) if len(found) > 1 else [(question.reading, next(iter(found.values()), 1.0))]


def _care(meaning: SignMeaning) -> tuple[int, float]:
    """The more careful action first, then the lower limit."""
    return careful_rank(meaning.legal_action), meaning.limit.mps if meaning.limit else float("inf")


def _interpret(book: RuleBook, question: SignQuestion, text: str) -> SignMeaning:
    here = normal_jurisdiction(question.jurisdiction)
    reading = parse_reading(text)
    own = book.for_jurisdiction(here) if here else ()
    for pack in own:
        if (sign := find_sign(pack, reading)) is not None:
            meaning = _meaning(book, pack, sign, question, text, reading, foreign=False)
            part = 1.0 if book.covers(here) else UNKNOWN_PART
            return msgspec.structs.replace(meaning, confidence=meaning.confidence * part)
    others = sorted(book.for_jurisdiction(None), key=is_fallback)
    found = [
        (pack, _meaning(book, pack, sign, question, text, reading, foreign=bool(own)))
        for pack in others
        if (sign := find_sign(pack, reading)) is not None
    ]
    if not found:
        return _unknown(question, text, own or others[-1:])
    return found[0][1] if own else _doubted(book, found, here, question.language)


def _doubted(book: RuleBook, found: list[tuple[Pack, SignMeaning]], here: str | None, language: str) -> SignMeaning:
    """Where it is not known whose sign it is: the most careful of all meanings, of equals the fallback's."""
    chosen = min(found, key=lambda each: (*_care(each[1]), not is_fallback(each[0])))[1]
    packs = named_packs(book, [pack for pack, _ in found], language)
    why = (
        say("no_law_here", language, country=country(book, here, language), packs=packs)
        if here
        else say("country_unknown", language, packs=packs)
    )
    return msgspec.structs.replace(
        chosen,
        confidence=chosen.confidence * UNKNOWN_COUNTRY,
        citations=cited_in_doubt(chosen.citations, ((pack, meaning.citations) for pack, meaning in found)),
        note=f"{chosen.note} {why}".strip(),
    )


def find_sign(pack: Pack, reading: Reading) -> Sign | None:
    """The entry of the sign table for a reading."""
    for name in reading.names:
        for sign in pack.signs.values():
            if name == sign.code or name in sign.aliases:
                return sign
    return None


def _unknown(question: SignQuestion, text: str, packs: Sequence[Pack]) -> SignMeaning:
    return SignMeaning(
        reading=text,
        national_code="",
        meaning=say("unknown_sign", question.language),
        language=spoken_language(question.language),
        legal_action="proceed_with_care",
        limit=None,
        citations=(),
        confidence=0.1,
        rulepack_version=packs[0].version if packs else "",
    )


def _meaning(
    book: RuleBook, pack: Pack, sign: Sign, question: SignQuestion, text: str, reading: Reading, *, foreign: bool
) -> SignMeaning:
    language, limit = question.language, _limit(pack, sign, reading, question)
    binding, bound, why = _bound(sign, question)
    confidence = (FOREIGN_SIGN if foreign else 1.0) * (STALE if book.weaknesses(pack) else 1.0)
    if sign.values and reading.value not in sign.values:
        confidence *= UNUSUAL_VALUE
    confidence *= PRESUMED if why else 1.0
    return SignMeaning(
        reading=text,
        national_code=_national(sign, reading),
        meaning=_filled(book, sign, reading, language, pack.manifest.units),
        language=spoken_language(language),
        legal_action=min(sign.action, binding.action, key=careful_rank) if bound else sign.action,
        limit=limit,
        citations=(cite_sign(pack, sign, language), *cite_ids(pack, sign.provisions, language)),
        confidence=confidence,
        rulepack_version=pack.version,
        note=" ".join(
            [*([say(why, language)] if why else []), *_notes(book, pack, sign, question, limit, foreign=foreign)]
        ),
        binds=(*binding.surely, *binding.perhaps),
    )


def _bound(sign: Sign, question: SignQuestion) -> tuple[Binding, bool, str]:
    """Which vehicles the sign binds, whether it is taken to bind this vehicle, and the phrase that says why in doubt."""
    binding, mine = BINDINGS.get(sign.code, _EVERYBODY), question.vehicle_class
    if binding is _EVERYBODY or mine in binding.surely:
        return binding, binding is not _EVERYBODY, ""
    if mine is None:
        return binding, True, "class_unknown"
    return (binding, True, "class_perhaps") if mine in binding.perhaps else (binding, False, "")


def _limit(pack: Pack, sign: Sign, reading: Reading, question: SignQuestion) -> LegalLimit | None:
    if sign.effect in ("limit", "zone"):
        shown = reading.value is not None and SHOWN[0] <= reading.value <= SHOWN[1]
        return legal_limit(reading.value, sign.unit or pack.manifest.units) if shown and reading.value else None
    road = {"town": "urban", "road": "motorway", "calm": "living_street"}.get(sign.effect or "")
    return _default_of(pack, road, question) if road else None


def _default_of(pack: Pack, road: str, question: SignQuestion) -> LegalLimit | None:
    """The lowest limit the law sets for a car, or for this class of vehicle, on this type of road in this part of the country."""
    here = normal_jurisdiction(question.jurisdiction)
    mine = None if question.vehicle_class == "car" else question.vehicle_class
    found = [
        legal_limit(effect.value, effect.unit)
        for provision in pack.provisions.values()
        for effect in provision.effects
        if isinstance(effect, Limit)
        and (_of_a_car(effect.when, road) or (mine in effect.when.vehicle_classes and road in effect.when.road_types))
        and effect.when.subdivision in (None, here)
        and effect.when.posted_below is None
    ]
    return min(found, key=lambda limit: limit.mps) if found else None


def _of_a_car(when: When, road: str) -> bool:
    return when.road_types == (road,) and (not when.vehicle_classes or "car" in when.vehicle_classes)


def _national(sign: Sign, reading: Reading) -> str:
    return sign.national.replace("{value}", "" if reading.value is None else f"{reading.value:g}").rstrip("-")


def _filled(book: RuleBook, sign: Sign, reading: Reading, language: str, units: Unit) -> str:
    value = "?" if reading.value is None else f"{reading.value:g}"
    text = text_in(sign.meaning, language).replace("{value}", value).replace("{unit}", sign.unit or units)
    return text.replace("{country}", country(book, reading.word.upper(), language)) if reading.word else text


def _notes(
    book: RuleBook, pack: Pack, sign: Sign, question: SignQuestion, limit: LegalLimit | None, *, foreign: bool
) -> list[str]:
    language, here = question.language, normal_jurisdiction(question.jurisdiction)
    notes: list[str] = []
    if foreign and here:
        there = country(book, pack.manifest.jurisdiction, language)
        notes.append(say("foreign", language, here=country(book, here, language), there=there))
    if sign.note:
        notes.append(text_in(sign.note, language))
    for plate in question.plates:
        if (entry := find_sign(pack, parse_reading(plate))) is not None:
            notes.append(text_in(entry.meaning, language))
            notes.append(text_in(entry.note, language))
    if limit is not None and limit.unit != question.home_unit:
        shown = spoken(limit.value, limit.unit)
        converted = spoken_converted(limit.value, limit.unit, question.home_unit)
        notes.append(say("unit", language, limit=shown, converted=converted))
    return [note for note in notes if note]
