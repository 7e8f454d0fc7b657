"""Why it was decided so, and the smallest change of one quantity that would have decided otherwise."""

from collections.abc import Callable
from typing import NamedTuple

import msgspec

from proto.decision import ArbitrationRequest, Decision
from proto.perception import Track
from services.arbiter.assessment.assess import View
from services.arbiter.assessment.reading import Reading
from services.arbiter.decide import Inputs, decide, hazards_of, prepared, weigh
from services.arbiter.profiles.profile import Profile, reachability
from services.arbiter.state import ArbiterState

_STEPS = 24
_HALVINGS = 18


class Flip(msgspec.Struct, frozen=True, kw_only=True):
    """One quantity, moved alone: where it stands, where the decision changes, and to what."""

    quantity: str
    unit: str
    from_value: float
    to_value: float
    becomes: str
    share_of_span: float
    """The change as a share of the quantity's plausible span; what flips are ordered by."""


class Explanation(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of the tool `explain_decision`."""

    tick: int
    kind: str
    reason: str
    act_withheld: str
    objections: tuple[str, ...]
    hazard: str
    reach: str
    text: str
    flips: tuple[Flip, ...]
    """The smallest change first; empty: no single quantity flips the decision within its span."""
    decision: Decision


class _Lever(NamedTuple):
    name: str
    unit: str
    low: float
    high: float
    get: Callable[[ArbitrationRequest, Inputs], float | None]
    put: Callable[[ArbitrationRequest, Inputs, float], tuple[ArbitrationRequest, Inputs]]


def explain(request: ArbitrationRequest, inputs: Inputs, profile: Profile) -> Explanation:
    """Reason, objections and flips of one decision."""
    decision = decide(request, inputs, profile).decision
    state = prepared(request, inputs, profile)
    weighed = weigh(request, inputs, state, profile)
    flips = smallest_flips(request, inputs, profile)
    return Explanation(
        tick=request.tick,
        kind=decision.kind,
        reason=decision.reason,
        act_withheld=decision.act_withheld,
        objections=weighed.objections,
        hazard=next(iter(hazards_of(request, weighed, state, inputs, profile)), ""),
        reach=reachability(profile, inputs.state.adapted.delta).text,
        text=_text(decision, weighed.objections, flips),
        flips=flips,
        decision=decision,
    )


def smallest_flips(request: ArbitrationRequest, inputs: Inputs, profile: Profile) -> tuple[Flip, ...]:
    """For each lever the nearest value at which the verdict changes, ordered by the share of the span it takes."""
    found = (_flip(lever, request, inputs, profile) for lever in LEVERS)
    return tuple(sorted((flip for flip in found if flip is not None), key=lambda flip: flip.share_of_span))


def _verdict(request: ArbitrationRequest, inputs: Inputs, profile: Profile) -> str:
    decision = decide(request, inputs, profile).decision
    return f"{decision.kind} (ACT withheld)" if decision.act_withheld else decision.kind


def _flip(lever: _Lever, request: ArbitrationRequest, inputs: Inputs, profile: Profile) -> Flip | None:
    start = lever.get(request, inputs)
    if start is None:
        return None
    now = _verdict(request, inputs, profile)

    def at(value: float) -> str:
        return _verdict(*lever.put(request, inputs, value), profile)

    ends = [_first_change(at, now, start, end) for end in (lever.low, lever.high)]
    values = [end for end in ends if end is not None]
    if not values:
        return None
    value = min(values, key=lambda v: abs(v - start))
    return Flip(
        quantity=lever.name,
        unit=lever.unit,
        from_value=start,
        to_value=value,
        becomes=at(value),
        share_of_span=abs(value - start) / (lever.high - lever.low),
    )


def _first_change(at: Callable[[float], str], now: str, start: float, end: float) -> float | None:
    """The nearest value towards `end` with another verdict, to within a millionth of the way."""
    same = start
    for step in range(1, _STEPS + 1):
        value = start + (end - start) * step / _STEPS
        if at(value) != now:
            for _ in range(_HALVINGS):
                middle = (same + value) / 2.0
                same, value = (middle, value) if at(middle) == now else (same, middle)
            return value
        same = value
    return None


def _text(decision: Decision, objections: tuple[str, ...], flips: tuple[Flip, ...]) -> str:
    lines = [f"{decision.kind}: {decision.reason}."]
    if decision.kind != "ACT" and objections:
        lines.append(f"Against ACT: {'; '.join(objections)}.")
    if flips:
        flip = flips[0]
        lines.append(
            f"Smallest change that flips it: {flip.quantity} from {flip.from_value:.3g} to {flip.to_value:.3g} "
            f"{flip.unit} makes it {flip.becomes}."
        )
    else:
        lines.append("No single quantity flips it within its plausible span.")
    return " ".join(lines)


def _move_actors(
    request: ArbitrationRequest, inputs: Inputs, move: Callable[[Track], Track]
) -> tuple[ArbitrationRequest, Inputs]:
    asked = msgspec.structs.replace(
        request,
        lead=move(request.lead) if request.lead is not None else None,
        pedestrian=move(request.pedestrian) if request.pedestrian is not None else None,
        others=tuple(move(each) for each in request.others),
    )
    view = inputs.reading.view
    moved = msgspec.structs.replace(view, actors=tuple(move(track) for track in view.actors))
    inputs = msgspec.structs.replace(inputs, state=_as_if_watched(view, moved, inputs.state))
    return asked, msgspec.structs.replace(inputs, reading=_with_view(inputs.reading, moved))


def _as_if_watched(before: View, after: View, state: ArbiterState) -> ArbiterState:
    """What was watched moves along with where the actor is: the question is about another place, not about a jump."""
    by = {old.track_id: new.x_m - old.x_m for old, new in zip(before.actors, after.actors, strict=True)}
    sightings = tuple(
        msgspec.structs.replace(each, gap_m=each.gap_m + by.get(each.track_id, 0.0)) for each in state.sightings
    )
    return msgspec.structs.replace(state, sightings=sightings)


def _with_view(reading: Reading, view: View) -> Reading:
    return msgspec.structs.replace(reading, view=view)


def _actor(request: ArbitrationRequest) -> Track | None:
    return request.lead if request.lead is not None else request.pedestrian


def _shift(name: str) -> Callable[[ArbitrationRequest, Inputs, float], tuple[ArbitrationRequest, Inputs]]:
    def put(request: ArbitrationRequest, inputs: Inputs, value: float) -> tuple[ArbitrationRequest, Inputs]:
        actor = _actor(request)
        by = value - getattr(actor, name) if actor is not None else 0.0
        return _move_actors(
            request, inputs, lambda track: msgspec.structs.replace(track, **{name: getattr(track, name) + by})
        )

    return put


def _both(*names: str) -> Callable[[ArbitrationRequest, Inputs, float], tuple[ArbitrationRequest, Inputs]]:
    """Set a quantity that request and own reading both have, under the same name."""

    def put(request: ArbitrationRequest, inputs: Inputs, value: float) -> tuple[ArbitrationRequest, Inputs]:
        fields = dict.fromkeys(names, value)
        view = msgspec.structs.replace(inputs.reading.view, **fields)
        changed = msgspec.structs.replace(inputs, reading=_with_view(inputs.reading, view))
        return msgspec.structs.replace(request, **fields), changed

    return put


def _confidence(request: ArbitrationRequest, inputs: Inputs, value: float) -> tuple[ArbitrationRequest, Inputs]:
    fused = msgspec.structs.replace(request.fused, confidence=value)
    return msgspec.structs.replace(request, fused=fused), inputs


def _delta(request: ArbitrationRequest, inputs: Inputs, value: float) -> tuple[ArbitrationRequest, Inputs]:
    adapted = msgspec.structs.replace(inputs.state.adapted, delta=value)
    return request, msgspec.structs.replace(inputs, state=msgspec.structs.replace(inputs.state, adapted=adapted))


LEVERS: tuple[_Lever, ...] = (
    _Lever("distance to the actor", "m", 0.0, 120.0, lambda q, i: a.x_m if (a := _actor(q)) else None, _shift("x_m")),
    _Lever(
        "relative speed of the actor", "m/s", -40.0, 20.0, lambda q, i: a.vx_mps if (a := _actor(q)) else None,
        _shift("vx_mps"),
    ),
    _Lever("ego speed", "m/s", 0.0, 50.0, lambda q, i: q.ego_speed_mps, _both("ego_speed_mps")),
    _Lever("upper bound of friction", "", 0.05, 1.0, lambda q, i: q.mu_high, _both("mu_high")),
    _Lever("lower bound of friction", "", 0.05, 1.0, lambda q, i: q.mu_low, _both("mu_low")),
    _Lever("degradation h", "", 0.0, 1.0, lambda q, i: q.h, _both("h")),
    _Lever("confidence of the advice", "", 0.0, 1.0, lambda q, i: q.fused.confidence, _confidence),
    _Lever("Delta", "", 0.0, 0.4, lambda q, i: i.state.adapted.delta, _delta),
)  # fmt: skip
"""What can be moved, over which span; actors move together in both views."""
