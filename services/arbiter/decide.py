"""SILENT, SPEAK or ACT: pure, from the request, the arbiter's own reading, its state, its profile and its grant."""

from functools import partial
from typing import NamedTuple

import msgspec

from domain.ego_speed import CHANGE_MPS2, is_speed
from domain.speech import (
    Saying,
    adopted,
    being_heard,
    due,
    is_fresh,
    is_meant,
    last_warned,
    on_this_clock,
    said,
    standing,
    without,
)
from proto.decision import ArbitrationRequest, BrakeCommand, Decision, DecisionKind, SafetyMetrics
from proto.speech import Memory
from services.arbiter.assessment.assess import Numbers, View, lateral_violation, metrics, speak_bounds, worst
from services.arbiter.assessment.reading import Reading
from services.arbiter.assessment.risk import Utilities, utilities
from services.arbiter.braking import act, budget
from services.arbiter.braking.act import Need, Permission
from services.arbiter.braking.emergency import hardest_mps2, is_due, is_emergency, is_surely_last_moment
from services.arbiter.braking.guard import Case, case, emergency_objections, objections
from services.arbiter.braking.lasting import lasts, sighted, stands
from services.arbiter.braking.own_hazards import ANSWERED, HAZARDS, seen_hazards
from services.arbiter.braking.watching import watch
from services.arbiter.filters import FULL, Suggested, Suggests, filter_of
from services.arbiter.memory import adapt, attention
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import ArbiterState, Attention, Intervention, digest


class Inputs(msgspec.Struct, frozen=True, kw_only=True):
    """All that a decision depends on, the profile apart; logged with the decision."""

    reading: Reading
    state: ArbiterState
    permission: Permission = Permission()
    now_ns: int
    delta: float | None = None
    """The Delta that feedback relaxes to, where it is not the profile's own."""
    filter: str = FULL


class Verdict(NamedTuple):
    """The decision, the state after it, and the command if the car is to brake."""

    decision: Decision
    state: ArbiterState
    command: BrakeCommand | None


class Weighed(NamedTuple):
    """The numbers, before anything is decided."""

    case: Case
    speak: Numbers | None
    metrics: SafetyMetrics
    utilities: Utilities
    objections: tuple[str, ...]


def decide(request: ArbitrationRequest, inputs: Inputs, profile: Profile) -> Verdict:
    """One tick's verdict."""
    state = prepared(request, inputs, profile)
    weighed = weigh(request, inputs, state, profile)
    braking = _intervene(request, weighed, state, inputs, profile)
    intervention, command, withheld = braking.intervention, braking.command, braking.withheld
    brakes = command is not None or bool(withheld)
    present = hazards_of(request, weighed, state, inputs, profile, brakes=brakes)
    state = msgspec.structs.replace(state, memory=standing(state.memory, present, inputs.now_ns))
    pressing = _pressing(request, weighed, state, present, inputs, profile, brakes=brakes)
    word = _say(request, weighed, state, pressing, braking, inputs, profile)
    remembered = _remembered(state, request, word, pressing, inputs)
    after = msgspec.structs.replace(
        remembered, intervention=intervention, warned_ns=_warned_ns(remembered, inputs.now_ns)
    )
    decision = Decision(
        tick=request.tick,
        kind=word.kind,
        reason=word.reason,
        metrics=weighed.metrics,
        act_withheld=withheld,
        brake_mps2=command.deceleration_mps2 if command is not None else 0.0,
        profile=profile.name,
        profile_sha256=profile.sha256,
        state_sha256=digest(after),
        own=msgspec.json.decode(msgspec.json.encode(inputs)),
        hazard=word.hazard,
        memory=after.memory,
    )
    return Verdict(decision, after, msgspec.structs.replace(command, tick=request.tick) if command else None)


def redecide(request: ArbitrationRequest, logged: Decision, profile: Profile) -> Verdict:
    """Decide again from a trace: the request as it was, and what the arbiter had beside it."""
    inputs = msgspec.convert(logged.own, Inputs)
    if inputs.delta is not None:
        profile = msgspec.structs.replace(profile, delta=inputs.delta)
    return decide(request, inputs, profile)


def request_view(request: ArbitrationRequest) -> View:
    """What the orchestrator sees; a speed or an acceleration that no car has is unknown."""
    speed_mps, mps2 = request.ego_speed_mps, request.ego_acceleration_mps2
    return View(
        ego_speed_mps=speed_mps if speed_mps is not None and is_speed(speed_mps, 0, None) else None,
        ego_acceleration_mps2=mps2 if mps2 is not None and abs(mps2) <= CHANGE_MPS2 else None,
        actors=tuple(track for track in (request.lead, request.pedestrian, *request.others) if track is not None),
        h=request.h,
        brake_envelope=request.brake_envelope,
        mu_low=request.mu_low,
        mu_high=request.mu_high,
        following_factor=request.following_factor,
    )


def unbraked(view: View) -> View:
    """Without the deceleration that is the arbiter's own doing: what eases because of it is no reason to let go."""
    accel = view.ego_acceleration_mps2
    return msgspec.structs.replace(view, ego_acceleration_mps2=max(0.0, accel) if accel is not None else None)


def _unbraked_reading(reading: Reading) -> Reading:
    return msgspec.structs.replace(reading, view=unbraked(reading.view))


def weigh(request: ArbitrationRequest, inputs: Inputs, state: ArbiterState, profile: Profile) -> Weighed:
    """Risk, utilities and objections; ACT by the less risky of the two views, SPEAK by the riskier."""
    view, reading = request_view(request), inputs.reading
    speak = max(
        (worst(v, speak_bounds(v, profile), profile) for v in (view, reading.view)),
        key=lambda n: -1.0 if n is None else n.r,
    )
    braking = act.going(state.intervention, state.run_ns)
    asked, own = (unbraked(view), _unbraked_reading(reading)) if braking else (view, reading)
    due = partial(is_due, permission=inputs.permission, profile=profile)
    checked = case(request, asked, own, state, profile, due, inputs.now_ns)
    r_act = min(checked.asked.r, checked.own.r) if checked.asked is not None and checked.own is not None else 0.0
    gains = utilities(r_act, profile)
    numbers = msgspec.structs.replace(
        metrics(speak, checked.own, view, profile),
        r_act=r_act,
        u_act=gains.u_act,
        u_speak=gains.u_speak,
        margin=gains.margin,
        delta=state.adapted.delta,
        c_min=state.adapted.c_min,
        lateral_viol=lateral_violation(reading.neighbours, reading.view.ego_speed_mps, profile)
        if reading.lateral_neighbours_known
        else None,
    )
    return Weighed(checked, speak, numbers, gains, objections(checked))


def hazards_of(
    request: ArbitrationRequest,
    weighed: Weighed,
    state: ArbiterState,
    inputs: Inputs,
    profile: Profile,
    *,
    brakes: bool = False,
) -> tuple[str, ...]:
    """Hazards that must be spoken whatever the budget: the orchestrator's, those that the arbiter sees itself, and the one
    that it brakes for, or would brake for.
    """
    found = [request.fused.hazard] if request.fused.hazard else []
    if _suggests(inputs) is None:
        found += seen_hazards((request_view(request), inputs.reading.view), state.sightings, profile)
    if brakes and weighed.case.own is not None:
        found.append(HAZARDS[weighed.case.own.track.kind])
    return tuple(dict.fromkeys(found))


def wants_act(weighed: Weighed, delta: float) -> bool:
    """The paper's rule, (U_act - U_speak) > Delta and rss_viol, with every objection heard."""
    return not weighed.objections and weighed.utilities.margin > delta


def prepared(request: ArbitrationRequest, inputs: Inputs, profile: Profile) -> ArbiterState:
    """The state with time passed, feedback learnt and the own reading watched."""
    state = _on_this_clock(_running(inputs.state, inputs.now_ns, profile), inputs.now_ns, profile)
    adapted = adapt.learn(adapt.relax(state.adapted, inputs.now_ns, profile), request.feedback, profile)
    attended = attention.refill(state.attention, inputs.now_ns, profile)
    seen = watch(state.sightings, inputs.reading, inputs.now_ns, profile)
    heard = adopted(request.heard, inputs.now_ns) if request.heard is not None else state.memory
    memory = without(heard, request.past)
    return msgspec.structs.replace(state, adapted=adapted, attention=attended, memory=memory, sightings=seen)


def _running(state: ArbiterState, now_ns: int, profile: Profile) -> ArbiterState:
    """The running clock advanced, and braking forgotten that no window reaches."""
    run_ns = budget.advanced(state.run_ns, state.seen_ns, now_ns)
    aged = act.aged(state.intervention, run_ns, profile)
    return msgspec.structs.replace(state, run_ns=run_ns, seen_ns=now_ns, intervention=aged)


def _on_this_clock(state: ArbiterState, now_ns: int, profile: Profile) -> ArbiterState:
    """Where the clock was set back: without what was told and watched by the time that it showed before, and at rest."""
    if not attention.set_back(state.attention, now_ns):
        return state
    return msgspec.structs.replace(
        state,
        attention=Attention(messages=state.attention.messages),
        memory=on_this_clock(state.memory, now_ns),
        intervention=act.stop(state.intervention, state.run_ns, profile),
        sightings=(),
    )


class _Braking(NamedTuple):
    """The intervention, its command, why it was withheld, and whether the conditions of an emergency hold."""

    intervention: Intervention
    command: BrakeCommand | None = None
    withheld: str = ""
    hard: bool = False


def _intervene(
    request: ArbitrationRequest, weighed: Weighed, state: ArbiterState, inputs: Inputs, profile: Profile
) -> _Braking:
    running, permission, case = state.intervention, inputs.permission, weighed.case
    hard = is_emergency(case, permission, profile)
    meant = _braked_for(request, weighed, state, inputs, profile, hard=hard)
    on = act.going(running, state.run_ns)
    goes_on = on and _suggests(inputs) is None and (_held(inputs) or lasts(case, running, state.run_ns, profile))
    if meant is None and not goes_on:
        return _Braking(act.let_go(running, state.run_ns))
    if permission.refused:
        return _Braking(act.let_go(running, state.run_ns), withheld=permission.refused)
    if not on and _warns_first(weighed, state, inputs, profile):
        return _Braking(act.let_go(running, state.run_ns), withheld="the driver is warned first")
    need = _need(meant, case, inputs, profile, hard=hard)
    after, command, withheld = act.brake(running, need, permission, inputs.reading.pedals, state.run_ns, profile)
    return _Braking(sighted(after, running, case, state.run_ns, profile), command, withheld, hard)


def _need(meant: Suggested | None, case: Case, inputs: Inputs, profile: Profile, *, hard: bool) -> Need:
    view, own = inputs.reading.view, case.own
    if meant is None and own is not None and view.ego_speed_mps is not None:
        meant = Suggested(own, view.ego_speed_mps)
    return Need(
        mps2=act.danger_mps2(meant.actor, meant.ego_mps, profile) if meant is not None else 0.0,
        hard=hard,
        grip_mps2=min(act.grip_mps2(view, profile), hardest_mps2(case, profile)),
        stands=stands(view.ego_speed_mps),
    )


def _suggests(inputs: Inputs) -> Suggests | None:
    """The filter that passes braking on unjudged, which goes on as long as it is suggested; None: the arbiter judges."""
    passing = filter_of(inputs.filter)
    return passing.suggested if passing is not None else None


def _held(inputs: Inputs) -> bool:
    """Whether an intervention may hold the car at standstill: what it stands before is near, and may be out of sight."""
    return stands(inputs.reading.view.ego_speed_mps) and inputs.permission.envelope == "emergency"


def _warns_first(weighed: Weighed, state: ArbiterState, inputs: Inputs, profile: Profile) -> bool:
    """Whether the driver has not been warned for long enough, and there is time for it."""
    if _suggests(inputs) is not None:
        return False
    warned = state.warned_ns is not None and state.run_ns - state.warned_ns >= profile.act_warned_s * 1e9
    return not warned and not is_surely_last_moment(weighed.case, inputs.permission, profile)


def _warned_ns(state: ArbiterState, now_ns: int) -> int | None:
    """Since when on the running clock the driver has been warned of a road user without a break; None: not recently."""
    if all(last_warned(state.memory, hazard, now_ns) is None for hazard in sorted(ANSWERED)):
        return None
    return state.run_ns if state.warned_ns is None else state.warned_ns


def _braked_for(
    request: ArbitrationRequest, weighed: Weighed, state: ArbiterState, inputs: Inputs, profile: Profile, *, hard: bool
) -> Suggested | None:
    """The road user to brake for: braking for it begins now, or it is the danger of the intervention under way."""
    if (suggests := _suggests(inputs)) is not None:
        return suggests(request, request_view(request), profile)
    own, ego = weighed.case.own, inputs.reading.view.ego_speed_mps
    if own is None or ego is None:
        return None
    emergency = hard and not emergency_objections(weighed.case)
    wanted = emergency or wants_act(weighed, state.adapted.delta)
    return Suggested(own, ego) if weighed.case.due and wanted else None


class _Said(NamedTuple):
    kind: DecisionKind
    reason: str
    hazard: str = ""


class _Pressing(NamedTuple):
    """A hazard, and whether it is still to be said."""

    hazard: str
    alarm: bool
    fresh: bool
    answered: bool


def _pressing(
    request: ArbitrationRequest, weighed: Weighed, state: ArbiterState, present: tuple[str, ...], inputs: Inputs,
    profile: Profile, *, brakes: bool,
) -> _Pressing:  # fmt: skip
    """Of the hazards present the first that the driver was not told of yet or is to be told of again; else the first of all."""

    def judged(hazard: str) -> _Pressing:
        # an intervention that is withheld is an alarm: spoken at once, and again in its time, not ten times a second
        alarm = brakes or (request.fused.urgency == "alarm" and hazard == request.fused.hazard)
        return _Pressing(
            hazard,
            alarm,
            is_fresh(state.memory, hazard, inputs.now_ns, profile.hazard_repeat_s, alarm=alarm),
            _answered(weighed, state.memory, hazard, inputs, profile, alarm=alarm),
        )

    found = [judged(hazard) for hazard in present or ("",)]
    if inputs.filter != FULL:
        return found[0]
    return next((each for each in found if each.fresh and not each.answered), found[0])


def _say(
    request: ArbitrationRequest,
    weighed: Weighed,
    state: ArbiterState,
    pressing: _Pressing,
    braking: _Braking,
    inputs: Inputs,
    profile: Profile,
) -> _Said:
    hazard, fused, passing = pressing.hazard, request.fused, filter_of(inputs.filter)
    if braking.command is not None:
        judged = _suggests(inputs) is None
        reason = _act_reason(weighed, state, braking) if judged else "the fused advice warns: passed on"
        return _Said("ACT", reason, hazard)
    ended = act.going(state.intervention, state.run_ns) and not pressing.answered
    if braking.withheld and (pressing.fresh or ended):
        return _Said("SPEAK", f"ACT withheld: {braking.withheld}", hazard)
    if passing is not None:
        passed, reason = passing.said(request)
        return _Said(passed, reason, hazard if passed == "SPEAK" else "")
    speak, reason = due(
        Saying(
            fused=fused,
            hazard=hazard,
            fresh_hazard=pressing.fresh,
            answered=pressing.answered,
            being_heard=being_heard(state.memory, fused, inputs.now_ns, profile.speech_gap_s),
            c_min=state.adapted.c_min,
            messages=state.attention.messages,
            needed_messages=attention.needed(fused, profile),
        )
    )
    if speak and reason == "hazard":
        return _Said("SPEAK", f"hazard: {hazard}", hazard)
    return _Said("SPEAK" if speak else "SILENT", reason)


def _remembered(
    state: ArbiterState, request: ArbitrationRequest, word: _Said, pressing: _Pressing, inputs: Inputs
) -> ArbiterState:
    """The state after what is spoken, with everyone who is in the path at that word. An intervention's words stand in every tick
    and are spoken in their time; what they do not say is still owed.
    """
    acts = word.kind == "ACT"
    if word.kind == "SILENT" or (acts and not pressing.fresh):
        return state
    if acts and not request.fused.hazard:
        request = msgspec.structs.replace(request, message=None)
    views = (request_view(request), inputs.reading.view)
    in_path = tuple(sorted({track.track_id for view in views for track in view.actors}))
    memory = said(state.memory, request, word.hazard, inputs.now_ns, alarm=pressing.alarm, track_ids=in_path)
    spends = word.reason == "new advice"
    attended = attention.spend(state.attention) if spends else state.attention
    return msgspec.structs.replace(state, memory=memory, attention=attended)


def _answered(weighed: Weighed, memory: Memory, hazard: str, inputs: Inputs, profile: Profile, *, alarm: bool) -> bool:
    """Whether the driver was told of this road user recently, as gravely as now, and brakes as hard as the worst of all needs."""
    last = last_warned(memory, hazard, inputs.now_ns)
    view = inputs.reading.view
    if last is None or (alarm and not last.alarm) or hazard not in ANSWERED or weighed.speak is None:
        return False
    if not is_meant(last, weighed.speak.track, inputs.now_ns):
        return False
    if view.ego_speed_mps is None or view.ego_acceleration_mps2 is None:
        return False
    needed = act.needed_mps2(weighed.speak, view.ego_speed_mps, profile)
    return -view.ego_acceleration_mps2 >= max(needed, profile.answer_mps2)


def _act_reason(weighed: Weighed, state: ArbiterState, braking: _Braking) -> str:
    if braking.intervention.holds:
        return "the car is held at standstill until the driver takes over"
    if braking.hard:
        return "an emergency: no later braking avoids the impact, and RSS is violated"
    if wants_act(weighed, state.adapted.delta):
        return (
            f"U_act - U_speak = {weighed.utilities.margin:.3f} > Delta = {state.adapted.delta:.3f} and RSS is violated"
        )
    return "the danger that the car is braked for is still there"
