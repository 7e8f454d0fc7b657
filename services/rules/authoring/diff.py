"""What changed for a driver between two versions of a pack, in words."""

from collections.abc import Iterator, Mapping

import msgspec

from domain.units import to_mps
from services.rules.authoring.wording import said, spaced, subject, value
from services.rules.packs.format import (
    Advisory,
    Condition,
    Duty,
    Effect,
    Limit,
    Minimum,
    Prohibition,
    Provision,
    RightOfWay,
    Sign,
)
from services.rules.packs.loading import Pack

_ABOUT = {
    "jurisdiction": "country",
    "units": "unit of speed",
    "traffic_side": "side of traffic",
    "effective_from": "in force from",
    "effective_until": "in force until",
    "precedence": "order of precedence",
}
WARNED = ("RAISED", "OTHER LIMITS MAY HOLD")
"""Stand in lines about what raises a limit, or may."""
_MAY = f", so that {WARNED[1]}"
_OF_LIMITS = ("effect", "unit", "plate")
"""Fields of a sign by which it sets, ends or narrows a limit."""
_SPEEDS, _CONDUCT, _READING = (Limit, Advisory, Minimum), (Prohibition, Duty, RightOfWay), (Condition,)


class Difference(msgspec.Struct, frozen=True, kw_only=True):
    """Lines under a heading, in the order in which a driver would want to know."""

    heading: str
    lines: tuple[str, ...]


def differences(old: Pack, new: Pack) -> tuple[Difference, ...]:
    """What a driver meets differently; inherited provisions count. Empty: nothing that a driver would notice."""
    found = (
        ("The pack", _manifest(old, new)),
        ("What counts as what", _kinds(old.provisions, new.provisions)),
        ("Speeds", _effects(old, new, _SPEEDS)),
        ("Prohibitions, duties, right of way", _effects(old, new, _CONDUCT)),
        ("How signs are read", _effects(old, new, _READING)),
        ("Signs", _signs(old.signs, new.signs)),
        ("Texts", _texts(old.provisions, new.provisions)),
    )
    return tuple(Difference(heading=h, lines=tuple(told)) for h, lines in found if (told := list(lines)))


def _manifest(old: Pack, new: Pack) -> Iterator[str]:
    if old.version != new.version:
        yield f"{old.version} is now {new.version}"
    for field, words in _ABOUT.items():
        before, now = getattr(old.manifest, field), getattr(new.manifest, field)
        if before != now:
            yield f"{words}: {plain(before)} is now {plain(now)}{_MAY if field in ('units', 'precedence') else ''}"
    for road in sorted({*old.manifest.plausible_limits, *new.manifest.plausible_limits}):
        spans = [pack.manifest.plausible_limits.get(road) for pack in (old, new)]
        if spans[0] != spans[1]:
            yield f"limits believed of a doubtful sign, {road}: {plain(spans[0])} is now {plain(spans[1])}"


def _kinds(old: Mapping[str, Provision], new: Mapping[str, Provision]) -> Iterator[str]:
    """Where provisions contradict each other their kind decides which counts, so that another limit may hold."""
    for name, provision in new.items():
        if name in old and old[name].kind != provision.kind:
            was, now = spaced(old[name].kind), spaced(provision.kind)
            yield f"{was} is now {now}{_MAY}: {name} ({provision.section})"


def _effects(old: Pack, new: Pack, wanted: tuple[type[Effect], ...]) -> Iterator[str]:
    """Effects are the same where provision, subject and conditions are; then their value may have changed."""
    before, now = _keyed(old, wanted), _keyed(new, wanted)
    for key in [*before, *(key for key in now if key not in before)]:
        where = f" [{key[0]}]"
        was, becomes = before.get(key), now.get(key)
        if was is None and becomes is not None:
            yield f"new: {said(becomes)}{where}"
        elif was is not None and becomes is None:
            yield f"gone: {said(was)}{where}{_MAY if isinstance(was, Limit) else ''}"
        elif was is not None and becomes is not None and value(was) != value(becomes):
            yield f"{_changed(was, becomes)}{where}"


def _keyed(pack: Pack, wanted: tuple[type[Effect], ...]) -> dict[tuple[str, str, str], Effect]:
    found: dict[tuple[str, str, str], Effect] = {}
    for provision in pack.provisions.values():
        for effect in provision.effects:
            if isinstance(effect, wanted):
                where = msgspec.json.encode(getattr(effect, "when", None)).decode()
                found.setdefault((provision.id, subject(effect), where), effect)
                if found[provision.id, subject(effect), where] != effect:  # two values under one condition
                    found[provision.id, f"{subject(effect)} {value(effect)}", where] = effect
    return found


def _changed(was: Effect, now: Effect) -> str:
    if isinstance(was, Limit | Advisory | Minimum) and isinstance(now, Limit | Advisory | Minimum):
        up = to_mps(now.value, now.unit) > to_mps(was.value, was.unit)
        return f"{WARNED[0] if up else 'lowered'} from {value(was)}: {said(now)}"
    return f"changed from {value(was) or 'nothing'}: {said(now)}"


def _signs(old: Mapping[str, Sign], new: Mapping[str, Sign]) -> Iterator[str]:
    for code, sign in new.items():
        if code not in old:
            yield f"new: {code} ({sign.national}): {_meaning(sign)}"
        else:
            yield from (f"{code} ({sign.national}): {line}" for line in _sign(old[code], sign))
    for code, sign in old.items():
        if code not in new:
            yield f"gone: {code} ({sign.national}): {_meaning(sign)}{_MAY if sign.effect else ''}"


def _sign(was: Sign, now: Sign) -> Iterator[str]:
    for field in ("national", "action", "effect", "unit", "values", "plate", "shape"):
        before, after = getattr(was, field), getattr(now, field)
        if before != after:
            yield f"{field}: {plain(before)} is now {plain(after)}{_MAY if field in _OF_LIMITS else ''}"
    for language in sorted({*was.meaning, *now.meaning}):
        if was.meaning.get(language) != now.meaning.get(language):
            yield f"meaning ({language}) is now: {now.meaning.get(language, 'nothing')}"


def _texts(old: Mapping[str, Provision], new: Mapping[str, Provision]) -> Iterator[str]:
    for name, provision in new.items():
        if name not in old:
            yield f"new: {name} ({provision.section})"
            continue
        texts = [{source.language: source.excerpt for source in p[name].sources} for p in (old, new)]
        languages = [which for which in sorted({*texts[0], *texts[1]}) if texts[0].get(which) != texts[1].get(which)]
        if languages:
            yield f"reworded: {name} ({provision.section}), {', '.join(languages)}"
    yield from (f"gone: {name} ({p.section})" for name, p in old.items() if name not in new)


def _meaning(sign: Sign) -> str:
    return sign.meaning.get("en") or next(iter(sign.meaning.values()), "")


def plain(found: object) -> str:
    """A value of a field for people."""
    if found is None or found == ():
        return "nothing"
    if isinstance(found, tuple):
        return ", ".join(f"{part:g}" if isinstance(part, float | int) else str(part) for part in found)
    if isinstance(found, msgspec.Struct):
        return " ".join(str(part) for part in msgspec.to_builtins(found).values() if part)
    return str(found)
