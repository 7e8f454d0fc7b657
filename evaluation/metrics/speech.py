"""What the driver has to listen to: messages, nags, and slow-downs that nothing called for."""

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import pairwise
from statistics import quantiles

import msgspec

from evaluation.metrics.conflicts import median_stop_m, nearest_ttc_s, ttc_s, violates_rss
from evaluation.metrics.hazards import on_now
from evaluation.metrics.law import SAME_LIMIT_MPS
from evaluation.metrics.record import At, Record
from proto.decision import Advisory, Urgency
from proto.messages import ROWS, Kind
from proto.truth import TrueActor, Truth
from services.simulator.people.in_the_way import CORRIDOR_HALF_M, LOOKS_M, SOON_S
from services.simulator.truth.hazard_words import names

FORGOTTEN_S = 60.0
"""Ours: what was said longer ago may be said again."""
REPEATED_S = 20.0
"""Ours: the same words within this time are a repeat, whatever they are on."""
STANDS_S = 4.0
"""Ours: a warning may be repeated after so long while its hazard is on."""
OF_ROAD_USERS = frozenset({*ROWS[Kind.LEAD].hazards, *ROWS[Kind.PERSON].hazards})
FOUNDED_S = 1.0
"""Ours: a warning is founded where truth shows its cause within this time of it."""
OTHER_TARGET_MPS = 5 / 3.6
"""Ours: a target that is lower by as much is news; a higher target is not."""
IN_WORDS = (Kind.STOP, Kind.FOREIGN)
"""Topics whose news are words: the state of a light, the meaning of a sign."""
OF_STOPS = (Kind.STOP,)
OF_PLACES, OTHER_PLACE_M = (Kind.GIVE_WAY,), 60.0
"""Ours: a word on a place to give way at is about another one after so much way; no two lines or crossings are nearer to each other."""
OF_LIMITS = (Kind.LIMIT, Kind.AHEAD, Kind.BORDER)
_WEIGHTS: dict[Urgency, int] = {"info": 0, "advice": 1, "warning": 2, "alarm": 3}

SLOWED_MPS, SLOWED_WITHIN_S = 10 / 3.6, 10.0
"""Ours: a slow-down is a message with a target below the speed, after which the car loses 10 km/h within 10 s."""
CAUSE_TTC_S, CAUSE_HEADWAY_S, CAUSE_MU = 8.0, 1.5, 0.56
"""Ours, generous: an approach, a short headway, the friction from which the event table calls a road slippery."""
CLOSE_TTC_S = 5.0
"""Ours: a vehicle that is met later is no reason to say "brake". Forward-collision warnings come 2 to 4 s ahead."""


def nags(record: Record) -> int:
    """Repeats without new information.

    A message repeats an earlier one of the same topic, less than 60 s before, with the same hazard, limit and announced limit. The
    new message is no more urgent, its target is not clearly lower, and nothing in it is newly degraded. Such a repeat is not a nag
    where:

    - it warns of a hazard that is really on, and 4 s have passed since the last message that it repeats;
    - it has other words on a light or a sign;
    - it tells a stop again after that stop was over;
    - it is on another place to give way at;
    - it tells a limit again after the law's limit was another one.
    """
    told: dict[str, list[At[Advisory]]] = defaultdict(list)
    count = 0
    for each in record.spoken:
        before = told[each.message.topic]
        count += _is_nag(record, before, each)
        before.append(each)
    return count


def listening_s(record: Record) -> float:
    """Time in which the driver listens: the words of each message, up to the next one."""
    return sum(heard_s for heard_s, _ in _heard(record))


def cut_off(record: Record) -> int:
    """Messages that the next one cut off before their last word."""
    return sum(cut for _, cut in _heard(record))


def _heard(record: Record) -> Iterator[tuple[float, bool]]:
    """How long each message was heard, and whether it was cut off."""
    for now, later in pairwise((*record.spoken, None)):
        if now is None:
            continue
        takes_s = words_s(now.message.directive)
        left_s = later.time_s - now.time_s if later is not None else math.inf
        yield min(takes_s, left_s), left_s < takes_s


def words_s(text: str) -> float:
    """How long a text takes to be spoken."""
    return len(re.findall(r"[^\W_]+(?:['’-][^\W_]+)*", text)) / WORDS_PER_S


WORDS_PER_S = 156.0 / 60.0
"""Of warnings (NHTSA 1996, as quoted second-hand)."""


def repeats(record: Record) -> int:
    """Messages in the words of another one within 20 s before, whatever either is on."""
    spoken_s: dict[str, float] = {}
    count = 0
    for time_s, message in record.spoken:
        count += time_s - spoken_s.get(message.directive, -math.inf) < REPEATED_S
        spoken_s[message.directive] = time_s
    return count


def _is_nag(record: Record, before: Sequence[At[Advisory]], now: At[Advisory]) -> bool:
    repeated = [each for each in before if _repeats(each, now)]
    if not repeated or _stands(record, repeated[-1], now):
        return False
    return any(not _news(record, each, now) for each in reversed(repeated))


def _repeats(before: At[Advisory], now: At[Advisory]) -> bool:
    old, new = before.message, now.message
    return (
        now.time_s - before.time_s < FORGOTTEN_S
        and old.hazard == new.hazard
        and old.legal_limit == new.legal_limit
        and old.ahead_mps == new.ahead_mps
        and _WEIGHTS[new.urgency] <= _WEIGHTS[old.urgency]
        and not _lower(old.target_mps, new.target_mps)
        and set(new.degraded) <= set(old.degraded)
    )


def _lower(old_mps: float | None, new_mps: float | None) -> bool:
    return new_mps is not None and (old_mps is None or new_mps <= old_mps - OTHER_TARGET_MPS)


def _news(record: Record, before: At[Advisory], now: At[Advisory]) -> bool:
    """Whether the world or the words make it news since that one all the same."""
    if now.message.topic in IN_WORDS and now.message.directive != before.message.directive:
        return True
    if now.message.topic in OF_PLACES and _driven_m(record, before, now) > OTHER_PLACE_M:
        return True
    if now.message.topic in OF_STOPS and _stop_over(record, before, now):
        return True
    return now.message.topic in OF_LIMITS and _law_changed(record, before, now)


def _driven_m(record: Record, before: At[Advisory], now: At[Advisory]) -> float:
    old, new = record.truth_at(before.time_s), record.truth_at(now.time_s)
    return new.distance_m - old.distance_m if old is not None and new is not None else 0.0


def _stop_over(record: Record, before: At[Advisory], now: At[Advisory]) -> bool:
    """Whether a light or sign that had one stop let one go meanwhile: what is told now is another red, or another line."""
    between = record.truths_between(before.time_s, now.time_s)
    stops = (each.stop_kind for each in between if each.stop_kind != "yield")
    return any(old and new != old for old, new in pairwise(stops))


def _law_changed(record: Record, before: At[Advisory], now: At[Advisory]) -> bool:
    truth = record.truth_at(now.time_s)
    law_mps = (truth.law_limit_mps if truth is not None else None) or math.inf
    between = (each.law_limit_mps or math.inf for each in record.truths_between(before.time_s, now.time_s))
    return any(each != law_mps and not abs(each - law_mps) <= SAME_LIMIT_MPS for each in between)


def _stands(record: Record, before: At[Advisory], now: At[Advisory]) -> bool:
    truth = record.truth_at(now.time_s)
    if truth is None or not now.message.hazard or now.time_s - before.time_s < STANDS_S:
        return False
    return _really_on(truth, now.message)


def _really_on(truth: Truth, warning: Advisory, within_s: float = CAUSE_TTC_S) -> bool:
    """Whether the hazard that it names is there, or a vehicle that is met so soon: another one is no reason to repeat it."""
    if any(names(warning, each.kind) for each in on_now(truth)):
        return True
    if names(warning, "pedestrian"):
        return any(map(_in_the_way_soon, truth.actors))
    return names(warning, "lead_brakes") and _soon(ttc_s(truth.gap_m, truth.closing_mps), within_s)


def _in_the_way_soon(actor: TrueActor) -> bool:
    """A person ahead who is in the ego's path or walks into it, by the simulated driver's own measure."""
    if actor.kind != "pedestrian" or not 0.0 < actor.x_m < LOOKS_M:
        return False
    walks_in = actor.y_m * actor.vy_mps < 0.0 and abs(actor.y_m) < CORRIDOR_HALF_M + SOON_S * abs(actor.vy_mps)
    return actor.in_ego_path or walks_in


def false_warnings(record: Record) -> int:
    """Warnings of a vehicle or a person ahead for which truth knows no such road user within a second.

    Of a person: one in the path, or walking into it. Of a vehicle: one that is met within 5 s, of the end of a queue within 8 s, or that
    is nearer than RSS allows. Or a hazard that is on and that the warning names.
    """
    warned = [each for each in record.spoken if each.message.hazard in OF_ROAD_USERS]
    return sum(
        not any(
            founded(truth, each.message)
            for truth in record.truths_between(each.time_s - FOUNDED_S, each.time_s + FOUNDED_S)
        )
        for each in warned
    )


def founded(truth: Truth, warning: Advisory) -> bool:
    """Whether truth knows the road user or the hazard that a warning names."""
    within_s = CAUSE_TTC_S if warning.hazard == "slow_traffic" else CLOSE_TTC_S
    lead_alone = msgspec.structs.replace(truth, actors=())
    return _really_on(truth, warning, within_s) or (names(warning, "lead_brakes") and violates_rss(lead_alone))


def unnecessary_slow_downs(record: Record) -> int:
    """Messages after which the car lost 10 km/h within 10 s and for which the truth knows no cause in that time.

    Causes: a hazard, a place to stop, an approach, a short headway, a limit below the speed, a slippery road, or a speed
    at which one cannot stop within sight. Messages within 10 s of one that counted belong to it.
    """
    count, until_s = 0, -1.0
    for each in record.spoken:
        target, now = each.message.target_mps, record.truth_at(each.time_s)
        if now is None or target is None or target >= now.speed_mps or each.time_s < until_s:
            continue
        then = record.truths_between(each.time_s, each.time_s + SLOWED_WITHIN_S)
        slowed = now.speed_mps - min(truth.speed_mps for truth in then or (now,)) >= SLOWED_MPS
        if slowed and not any(_cause(truth, now.speed_mps) for truth in then):
            count, until_s = count + 1, each.time_s + SLOWED_WITHIN_S
    return count


def _cause(truth: Truth, speed_mps: float) -> bool:
    """Whether there is a reason to drive slower than one did."""
    limit = truth.law_limit_mps
    return bool(
        on_now(truth)
        or truth.stop_kind
        or truth.light in ("red", "red_amber", "amber")
        or _approaches(truth)
        or (truth.gap_m is not None and truth.gap_m < CAUSE_HEADWAY_S * speed_mps)
        or (limit is not None and limit < speed_mps)
        or truth.mu < CAUSE_MU
        or _beyond_sight(truth, speed_mps)
    )


def _approaches(truth: Truth) -> bool:
    return _soon(nearest_ttc_s(truth))


def _soon(ttc: float | None, within_s: float = CAUSE_TTC_S) -> bool:
    return ttc is not None and ttc < within_s


def _beyond_sight(truth: Truth, speed_mps: float) -> bool:
    if truth.visibility_m is None:
        return False
    return median_stop_m(speed_mps, truth) > truth.visibility_m


def advisory_latencies_s(record: Record) -> tuple[float, ...]:
    """The paper's advisory latency of each tick in which an event began and something was said: event to advice."""
    return _seconds([each.message.event_to_advice_ms for each in record.advisories])


def sensor_latencies_s(record: Record) -> tuple[float, ...]:
    """Picture to advice, of each tick that a picture caused."""
    return _seconds([each.message.snapshot_to_advice_ms for each in record.advisories])


def _seconds(values_ms: list[float | None]) -> tuple[float, ...]:
    return tuple(value / 1e3 for value in values_ms if value is not None)


def percentile(values: tuple[float, ...], percent: int) -> float | None:
    """By linear interpolation between ranks; None of nothing."""
    if len(values) < 2:
        return values[0] if values else None
    return quantiles(values, n=100, method="inclusive")[percent - 1]


def mean_target_mps(record: Record) -> float | None:
    """Mean over time of the speed that the system holds to be right; None where it never had one."""
    found = [each.message.target_mps for each in record.advisories if each.message.target_mps is not None]
    return sum(found) / len(found) if found else None
