"""A clock that was set back: what is stamped later than now would be young for as long, and is forgotten or stamped now."""

from typing import Any

import msgspec

from domain import speech
from services.orchestrator.observations.local_time import set_back
from services.orchestrator.observations.validity import EXPERT_VALID_NS
from services.orchestrator.state import Held, InForce, Light, Overspeed, SignAhead, Signs, State


def on_this_clock(state: State, now_ns: int) -> State:
    """The state without a word, question, onset or sighting from a time that is yet to come; the same where the clock goes on."""
    if now_ns >= state.now_ns:
        return state
    return msgspec.structs.replace(
        state,
        asked=tuple(each for each in state.asked if each.stamp_ns <= now_ns),
        memory=speech.on_this_clock(state.memory, now_ns),
        held=_held(state.held, now_ns),
        signs=_signs(state.signs, now_ns),
        light=_light(state.light, now_ns),
        overspeed=_overspeed(state.overspeed, now_ns),
        utc=set_back(state.utc, now_ns),
        onsets=tuple(each for each in state.onsets if each.last_ns <= now_ns),
        missing=tuple(each for each in state.missing if each.since_ns <= now_ns),
        gaps=tuple(each for each in state.gaps if each.stamp_ns <= now_ns),
    )


def _held(held: Held, now_ns: int) -> Held:
    """What bounds the target stays, and is no younger than now."""
    fields: dict[str, Any] = {"legal_ns": min(held.legal_ns, now_ns)}
    fields["lost"] = tuple(
        msgspec.structs.replace(each, stamp_ns=min(each.stamp_ns, now_ns), higher_ns=None, higher_mps=None)
        for each in held.lost
    )
    fields["limiters"] = tuple(
        msgspec.structs.replace(each, until_ns=min(each.until_ns, now_ns + EXPERT_VALID_NS)) for each in held.limiters
    )
    if held.speed is not None and held.speed.stamp_ns > now_ns:
        fields["speed"] = None
    return msgspec.structs.replace(held, **fields)


def _light(light: Light | None, now_ns: int) -> Light | None:
    """A red light stands; a permission from a time that is yet to come would not wear off, and hide the red of its lamp."""
    if light is None or light.seen_ns <= now_ns:
        return light
    return None if light.permits else msgspec.structs.replace(light, seen_ns=now_ns)


def _signs(signs: Signs, now_ns: int) -> Signs:
    return msgspec.structs.replace(
        signs,
        permanent=_in_force(signs.permanent, now_ns),
        gantry=_in_force(signs.gantry, now_ns),
        zone=_in_force(signs.zone, now_ns),
        conditional=tuple(_since(each, now_ns) for each in signs.conditional),
        ahead=tuple(_sign(each, now_ns) for each in signs.ahead),
        recent=tuple(_sign(each, now_ns) for each in signs.recent),
    )


def _in_force(limit: InForce | None, now_ns: int) -> InForce | None:
    return None if limit is None else _since(limit, now_ns)


def _since(limit: InForce, now_ns: int) -> InForce:
    return msgspec.structs.replace(limit, since_ns=min(limit.since_ns, now_ns))


def _sign(sign: SignAhead, now_ns: int) -> SignAhead:
    return msgspec.structs.replace(sign, seen_ns=min(sign.seen_ns, now_ns), first_ns=min(sign.first_ns, now_ns))


def _overspeed(overspeed: Overspeed, now_ns: int) -> Overspeed:
    """One that lasts goes on; its sound, if it is given, begins anew."""
    return msgspec.structs.replace(
        overspeed,
        since_ns=_no_later(overspeed.since_ns, now_ns),
        above_ns=tuple(_no_later(each, now_ns) for each in overspeed.above_ns),
        sounded_ns=_no_later(overspeed.sounded_ns, now_ns),
    )


def _no_later(stamp_ns: int | None, now_ns: int) -> int | None:
    return None if stamp_ns is None else min(stamp_ns, now_ns)
