"""Stop, give way or proceed: light before sign before the general rule; a road user of whom nothing is known is taken to be there.

A sign demands what the pack states by a trigger for it (`sign:stop`), else what its own entry in the sign table says.
"""

import msgspec

from proto.rules import LegalAction, RightOfWayQuestion, RulesAnswer
from services.rules.book import STALE, UNKNOWN_COUNTRY, UNKNOWN_PART, RuleBook, is_fallback, normal_jurisdiction
from services.rules.citing import cite_ids, cited_in_doubt, without_packs
from services.rules.packs.format import RightOfWay
from services.rules.packs.loading import Pack
from services.rules.signs.meaning import careful_rank, find_sign
from services.rules.signs.sign_codes import Reading, parse_reading
from services.rules.words import country, named_packs, say

PRESUMED = 0.8
BASE = 0.95
CONFLICT = 0.7
"""Factor where one sign gives priority and another takes it."""
GUIDANCE = 0.85
"""Confidence of an answer that rests on guidance alone."""
NO_LIGHT = ("off", "amber_flashing")
"""Lights that leave signs and rules in force; what they demand themselves is added."""
UNKNOWN_LIGHT = {"red_amber": "red", "flashing_red": "red", "amber_flashing": "off", "green_arrow": "green"}
"""What a light is taken for by a law that does not name it."""
WIDER = {
    "turning_left": "turning", "turning_cyclists": "turning", "junction_pedestrians": "turning",
    "sign:level_crossing_gates": "sign:level_crossing",
}  # fmt: skip
"""The wider trigger that a law may state in the place of one that it does not."""
UNSTATED = 0.5
"""Factor where the law here does not state what was asked."""
CROSSINGS = frozenset({"crossing", "marking:zebra", "yield_to_pedestrians"})
"""Signs that demand something only where a person crosses."""
REPLACED_BY_LIGHTS = CROSSINGS | {
    "stop", "all_way_stop", "yield", "priority_road", "priority_here", "priority_here_left", "priority_here_right",
    "right_before_left", "roundabout", "mini_roundabout", "oncoming_priority", "priority_over_oncoming",
    "marking:give_way", "marking:stop_line", "marking:shark_teeth", "marking:waiting_line", "marking:cycle_box",
    "green_arrow", "no_turn_on_red", "wait_here_on_red",
}  # fmt: skip
"""Signs that say who goes first, or what a red light demands: a light that governs takes their place. All others hold beside it."""
DEMANDING: frozenset[LegalAction] = frozenset({"stop", "no_entry", "yield"})
"""Actions by which a sign's own entry governs; any other is an answer only where nothing governs."""


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """What one trigger or sign demands in one pack."""

    trigger: str
    action: LegalAction
    provision: str
    code: str = ""
    """Of the sign, where it is one."""


def right_of_way(book: RuleBook, question: RightOfWayQuestion) -> RulesAnswer:
    """The most careful demand of those that hold; under an unknown jurisdiction that of all packs."""
    here = normal_jurisdiction(question.jurisdiction)
    own = book.for_jurisdiction(here)
    packs = own or book.for_jurisdiction(None)
    known = here is not None and bool(own)
    answers = [(pack, _answer(book, pack, question)) for pack in packs]
    if not answers:
        return without_packs("proceed_with_care", "nothing_found", question.language)
    chosen = min(answers, key=lambda found: (careful_rank(found[1].legal_action), not is_fallback(found[0])))[1]
    if known and book.covers(here):
        return chosen
    if known:
        degraded = (*chosen.degraded, "jurisdiction")
        return msgspec.structs.replace(chosen, confidence=chosen.confidence * UNKNOWN_PART, degraded=degraded)
    named = named_packs(book, packs, question.language)
    what = (
        say("no_law_here", question.language, country=country(book, here, question.language), packs=named)
        if here
        else say("country_unknown", question.language, packs=named)
    )
    return msgspec.structs.replace(
        chosen,
        confidence=chosen.confidence * UNKNOWN_COUNTRY,
        citations=cited_in_doubt(chosen.citations, ((pack, answer.citations) for pack, answer in answers)),
        note=f"{chosen.note} {what}".strip(),
        degraded=(*chosen.degraded, "jurisdiction"),
    )


def demands(pack: Pack, table: dict[str, Found], question: RightOfWayQuestion) -> tuple[Found, ...]:
    """Everything that holds at this junction, the governing demand first."""
    signs = [_by_sign(pack, table, parse_reading(text)) for text in question.signs]
    lasting = tuple(each for each in signs if each is not None and each.code not in CROSSINGS)
    signed = tuple(each for each in lasting if each.action in DEMANDING or each.trigger in table)
    light = _first(table, _lights(question))
    if light and question.light not in NO_LIGHT:
        governing = light + tuple(each for each in signed if each.code not in REPLACED_BY_LIGHTS)
    else:
        governing = signed or _first(table, _unsigned(question)) or lasting
        governing = tuple(sorted(governing + light, key=lambda found: careful_rank(found.action)))
    crossing = _first(table, ("crossing",)) if _someone_crosses(question) else ()
    met = (_first(table, (name, WIDER.get(name, name))) for name in question.circumstances)
    return governing + crossing + tuple(found for each in met for found in each)


def _unstated(book: RuleBook, pack: Pack, here: dict[str, Found], question: RightOfWayQuestion) -> tuple[Found, ...]:
    """What the most careful of all laws demand where this one does not know a sign, or states nothing of what the ego does or meets."""
    missing = [name for name in question.circumstances if not _first(here, (name, WIDER.get(name, name)))]
    readings = [parse_reading(text) for text in question.signs]
    unknown = [each for each in readings if _by_sign(pack, here, each) is None and find_sign(pack, each) is None]
    if not missing and not unknown:
        return ()
    elsewhere = [(each, _table(each)) for each in book.for_jurisdiction(None)]
    found = [demand for _, table in elsewhere for name in missing for demand in _first(table, (name,))]
    found += [
        demand for each, table in elsewhere for read in unknown if (demand := _by_sign(each, table, read)) is not None
    ]
    found.append(Found(trigger="", action="proceed_with_care", provision=""))
    action = min((each.action for each in found), key=careful_rank)
    return (Found(trigger="", action=action, provision=""),)


def _answer(book: RuleBook, pack: Pack, question: RightOfWayQuestion) -> RulesAnswer:
    table = _table(pack)
    stated, unstated = demands(pack, table, question), _unstated(book, pack, table, question)
    found = stated + unstated
    differ = _contradict(found)
    weak = book.weaknesses(pack)
    actions: tuple[LegalAction, ...] = tuple(f.action for f in found) or ("proceed_with_care",)
    action = min(actions, key=careful_rank)
    # Nothing demands anything, for no road user comes: the rule that would otherwise hold is named.
    cited = stated or _first(table, ("unsigned",))
    citations = cite_ids(pack, (f.provision for f in cited), question.language)
    unknown = question.pedestrians_on_crossing is None or (
        question.traffic_from_priority_side is None and any(f.trigger == "unsigned" for f in found)
    )
    by_law = not stated or any(citation.kind != "guidance" for citation in citations)
    confidence = (BASE if by_law else GUIDANCE) * (PRESUMED if unknown else 1.0) * (STALE if weak else 1.0)
    confidence *= (CONFLICT if differ else 1.0) * (UNSTATED if unstated or not found else 1.0)
    notes = [citation.excerpt for citation in citations[:2]]
    said = [say(name, question.language) for name, so in (("signs_differ", differ), ("unstated", bool(unstated))) if so]
    return RulesAnswer(
        legal_action=_softened(action, question),
        limit=None,
        citations=citations,
        confidence=confidence,
        rulepack_version=pack.version,
        note=" ".join([*said, *notes]),
        basis="lookup" if stated else "unknown",
        degraded=("stale_rulepack",) if weak else (),
    )


def _contradict(found: tuple[Found, ...]) -> bool:
    """Whether a sign that gives priority stands beside one that takes it: one is misread, or not for us."""
    signed = {f.action for f in found if f.code in REPLACED_BY_LIGHTS}
    return bool(signed & {"stop", "yield"}) and bool(signed & {"proceed", "proceed_with_care"})


def _softened(action: LegalAction, question: RightOfWayQuestion) -> LegalAction:
    """The driver is not told plainly to proceed while it is unknown whether people cross."""
    return "proceed_with_care" if action == "proceed" and question.pedestrians_on_crossing is None else action


def _table(pack: Pack) -> dict[str, Found]:
    """Of several demands on one trigger that of the highest kind of provision; among them the most careful."""
    kinds = pack.manifest.precedence
    demanded = [
        (kinds.index(provision.kind), careful_rank(effect.action), provision.id, effect)
        for provision in pack.provisions.values()
        for effect in provision.effects
        if isinstance(effect, RightOfWay)
    ]
    found: dict[str, Found] = {}
    for _, _, name, effect in sorted(demanded, key=lambda demand: demand[:2]):
        found.setdefault(effect.trigger, Found(trigger=effect.trigger, action=effect.action, provision=name))
    return found


def _first(table: dict[str, Found], triggers: tuple[str, ...]) -> tuple[Found, ...]:
    return next(((table[name],) for name in triggers if name in table), ())


def _lights(question: RightOfWayQuestion) -> tuple[str, ...]:
    if question.light is None:
        return ()
    return f"light:{question.light}", f"light:{UNKNOWN_LIGHT.get(question.light, question.light)}"


def _by_sign(pack: Pack, table: dict[str, Found], reading: Reading) -> Found | None:
    for name in reading.names:
        for trigger in (f"sign:{name}", name, WIDER.get(f"sign:{name}", "")):
            if trigger in table:
                return msgspec.structs.replace(table[trigger], code=name)
    sign = find_sign(pack, reading)
    if sign is None or careful_rank(sign.action) > careful_rank("proceed_with_care"):
        return None
    return Found(trigger="", code=sign.code, action=sign.action, provision=f"sign:{sign.code}")


def _unsigned(question: RightOfWayQuestion) -> tuple[str, ...]:
    return () if question.traffic_from_priority_side is False else ("unsigned",)


def _someone_crosses(question: RightOfWayQuestion) -> bool:
    at_crossing = any(CROSSINGS.intersection(parse_reading(text).names) for text in question.signs)
    return bool(question.pedestrians_on_crossing) or (at_crossing and question.pedestrians_on_crossing is None)
