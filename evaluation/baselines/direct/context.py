"""The context block of a direct prompt: ego and what perception and front end see, in plain sentences or as JSON.

What only the experts know (the law in force, weather, the car's health) is left out: the Direct methods have no tools.
Signs and lights are told in the front end's own sentences, which its parser reads back; of a sign not yet passed they say so.
"""

import math
from collections.abc import Iterator

import msgspec

from domain.units import shown
from proto.observed import Observed
from proto.rules import PostedLimit
from proto.world import EgoState, WorldState
from services.orchestrator.signs.limits import may_be_ours
from services.orchestrator.state import SignAhead, State
from services.orchestrator.world.actors import Way, lead, pedestrian

MOST_CHARS = 7000
_SIGN = {"limit": "speed limit sign", "zone": "speed limit zone sign", "led": "speed limit"}
_NAMES = {"yield": "give way", "crossing": "pedestrian crossing"}


def context(state: State, form: str) -> str:
    """The block in the form that is set: `text` or `json`."""
    return as_json(state.world) if form == "json" else summary(state)


def summary(state: State) -> str:
    """Ego, road users, what is in force by the signs that were passed, then what is ahead."""
    parts = (_ego(state), _actors(state.world), _in_force(state), _ahead(state), _place(state))
    return "\n".join(sentence for part in parts for sentence in part)[:MOST_CHARS]


def as_json(world: WorldState) -> str:
    """`world_state` without what experts told, and without the farthest where all of it is too long."""
    ego = msgspec.structs.replace(world.ego, degradation_h=None, brake_envelope=None, dtcs=None, warning_lamps=None)
    environment = msgspec.structs.replace(world.environment, conditions=None)
    seen = msgspec.structs.replace(world, ego=ego, environment=environment)
    while len(text := msgspec.json.encode(seen).decode()) > MOST_CHARS:
        seen = _nearer(seen)
    return text


def _nearer(world: WorldState) -> WorldState:
    """Without the farthest road user; where none is left, without the farthest sign; then ego alone."""
    env = world.environment
    if world.actors is not None and world.actors.value:
        far = max(world.actors.value, key=lambda track: math.hypot(track.x_m, track.y_m))
        left = tuple(track for track in world.actors.value if track is not far)
        return msgspec.structs.replace(world, actors=msgspec.structs.replace(world.actors, value=left))
    if env.signs:
        post = max(env.signs, key=lambda sign: _far_m(sign.value.distance_m))
        signs = tuple(sign for sign in env.signs if sign is not post)
        return msgspec.structs.replace(world, environment=msgspec.structs.replace(env, signs=signs))
    return WorldState(stamp_ns=world.stamp_ns, tick=world.tick, ego=world.ego)


def _far_m(distance_m: float | None) -> float:
    return distance_m if distance_m is not None else math.inf


def signs_ahead(state: State) -> tuple[SignAhead, ...]:
    """Those of our lane that may be for a car, the nearest first."""
    ours = (each for each in state.signs.ahead if each.own_lane and may_be_ours(each.scope, each.plates, dry=False))
    return tuple(sorted(ours, key=lambda each: _far_m(each.distance_m)))


def shows_limit(sign: SignAhead) -> bool:
    """Whether a limit begins at it."""
    return sign.value is not None and sign.scope != "end"


def _ego(state: State) -> Iterator[str]:
    ego: EgoState = state.world.ego
    if ego.speed_mps is not None:
        unit = state.preferences.unit
        yield f"The ego vehicle drives at {shown(ego.speed_mps.value, unit)} {unit}."


def _actors(world: WorldState) -> Iterator[str]:
    first, person = lead(world), pedestrian(world)
    found = {way.track.track_id: way for way in (first, person) if way is not None}
    yield from map(_actor, sorted(found.values(), key=lambda way: way.gap_m))


def _actor(way: Way) -> str:
    nearer = " and comes nearer" if way.ttc_s is not None else ""
    return f"A {way.track.kind} is {max(0.0, way.gap_m):.0f} m ahead in the path{nearer}."


def _in_force(state: State) -> Iterator[str]:
    env = state.world.environment
    for limit in (env.dynamic_limit, env.zone_limit, env.conditional_limit, env.posted_limit):
        if limit is not None:
            yield _limit(limit)


def _limit(limit: Observed[PostedLimit]) -> str:
    posted = limit.value
    wet = " when wet" if posted.scope == "when_wet" else ""
    return f"{_shows(posted.reading)} of {posted.value:g} {posted.unit}{wet}."


def _shows(reading: str, where: str = "") -> str:
    head = reading.partition(":")[0]
    if head == "led":
        return f"The panel{where} shows a speed limit"
    return f"The traffic sign{where} is a {_SIGN.get(head, _SIGN['limit'])}"


def _ahead(state: State) -> Iterator[str]:
    light = state.world.environment.light
    if light is not None:
        yield f"The traffic light is {light.value.replace('_', ' and ')}."
    for sign in signs_ahead(state):
        yield _sign(sign)
        if sign.distance_m is not None:
            yield f"It stands {max(0.0, sign.distance_m):.0f} m ahead."


def _sign(sign: SignAhead) -> str:
    if not sign.believed:
        return "A sign ahead cannot be read for sure."
    if shows_limit(sign):
        wet = " when wet" if sign.scope == "when_wet" else ""
        return f"{_shows(sign.reading, ' ahead')} of {sign.value:g} {sign.unit or ''}".rstrip() + f"{wet}."
    name = sign.reading.partition(":")[0]
    return f"The traffic sign ahead is a {_NAMES.get(name, name.replace('_', ' '))} sign."


def _place(state: State) -> Iterator[str]:
    env = state.world.environment
    if env.road_type is not None:
        yield f"The road is {env.road_type.value.replace('_', ' ')}."
    if env.jurisdiction is not None:
        yield f"The signs are of {env.jurisdiction.value}."
    if env.units is not None:
        yield f"Speeds are in {env.units.value}."
