"""True hazards and the words for them: response time, time to collision at first escalation, hazards never told."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from domain.kinematics import needed_mps2
from evaluation.metrics.comfort import HARD_MPS2
from evaluation.metrics.conflicts import conflict_s, gap_m, median_stop_m, person_ahead, ttc_s
from evaluation.metrics.record import At, Record
from proto.decision import Advisory
from proto.truth import TrueActor, TrueHazard, Truth
from services.simulator.driver.driver import ADVICE_HOLDS_S, WARNING_HOLDS_S
from services.simulator.truth.hazard_words import OF_A_LEAD, WORDS, names

ESCALATES = ("warning", "alarm")
OF_SOMEBODY_AHEAD = frozenset(kind for kind, words in WORDS.items() if words == OF_A_LEAD)
_OF_A_BODY = OF_SOMEBODY_AHEAD | {"pedestrian"}
"""Of these hazards the road user itself is met; of others a line, a sign or water."""

LINES = frozenset({"red_light", "stop_sign"})
"""What has one stop at a line, as truth and messages name it."""
OTHER_LINE_M = 10.0
"""Ours: lines farther apart are two; the way driven and the way along the road differ by less."""
SLOWER = frozenset({"deep_water", "school_zone"})
"""Hazards that call for less speed and no stop: a word that asks for it is in time as long as they are on."""


WELL_MPS2 = 3.0
"""Ours: a hazard that needs no more, and is braked for by no more than `HARD_MPS2`, is met by ordinary driving."""
UNSEEN_IN_OUTCOME = frozenset({"deep_water"})
"""How a car behaves in it is not simulated: that nothing happened says nothing."""


class Episode(NamedTuple):
    """A hazard from its onset to when it was over."""

    kind: str
    onset_s: float
    over_s: float
    first: TrueHazard
    """As it was told at the onset."""
    way_m: float
    """What the ego had driven by then."""
    stop_kind: str
    """What truth had one stop for at the onset."""


class Answer(NamedTuple):
    """What was said about a hazard. `None`: nothing was said, or too late, or the gap did not close."""

    episode: Episode
    at_s: float | None
    """The first effective warning or intervention; before the onset, where that word still held then."""
    ttc_s: float | None
    """At the first escalation."""

    @property
    def before(self) -> bool:
        """Whether the hazard was answered before its onset."""
        return self.at_s is not None and self.at_s < self.episode.onset_s

    @property
    def response_s(self) -> float | None:
        """Onset to the answer; `None`: no answer, or one before the onset."""
        return None if self.at_s is None or self.before else self.at_s - self.episode.onset_s


def episodes(record: Record) -> tuple[Episode, ...]:
    """All hazards of a run; the same kind and onset is the same hazard."""
    found: dict[tuple[str, float], Episode] = {}
    for truth in record.truths:
        for hazard in on_now(truth):
            key = hazard.kind, hazard.onset_s
            began = found.setdefault(key, Episode(*key, truth.time_s, hazard, truth.distance_m, truth.stop_kind))
            found[key] = began._replace(over_s=truth.time_s)
    return tuple(found[key] for key in sorted(found))


def on_now(truth: Truth) -> tuple[TrueHazard, ...]:
    """The hazards that are on; from a truth that tells but the oldest, that one."""
    if truth.hazards or not truth.hazard or truth.hazard_onset_s is None:
        return truth.hazards
    return (TrueHazard(kind=truth.hazard, onset_s=truth.hazard_onset_s),)


def any_on(record: Record, time_s: float) -> bool:
    """Whether a hazard is on at an instant of the run."""
    truth = record.truth_at(time_s)
    return truth is not None and bool(on_now(truth))


def answers(record: Record) -> tuple[Answer, ...]:
    """What was said about each hazard."""
    return tuple(_answer(record, episode) for episode in episodes(record))


def met_untold(record: Record, told: Sequence[Answer]) -> int:
    """How many of the unanswered hazards the driver met well without a word."""
    return sum(each.at_s is None and _went_well(record, each.episode) for each in told)


def _went_well(record: Record, episode: Episode) -> bool:
    """Whether there was no infraction, no contact, and never more than ordinary braking, needed or done."""
    if episode.kind in UNSEEN_IN_OUTCOME:
        return False
    return all(_goes_well(truth, episode) for truth in record.truths_between(episode.onset_s, episode.over_s))


def _goes_well(truth: Truth, episode: Episode) -> bool:
    if truth.infraction or truth.collision or -truth.acceleration_mps2 > HARD_MPS2:
        return False
    body = _body(truth, _now(truth, episode) or episode.first)
    if body is not None and not body.in_ego_path:
        return True
    gap, closing = distance(truth, episode)
    return gap is None or closing <= 0.0 or needed_mps2(closing, gap) <= WELL_MPS2


def by_kind(told: Sequence[Answer]) -> dict[str, tuple[Answer, ...]]:
    """The answers by their hazards' kinds, in alphabetical order."""
    kinds = sorted({each.episode.kind for each in told})
    return {kind: tuple(each for each in told if each.episode.kind == kind) for kind in kinds}


def _answer(record: Record, episode: Episode) -> Answer:
    about = [each for each, _ in record.told if _in_time(each, episode) and _is_on(record, each, episode)]
    effective = (each for each in about if _effective(record, each, episode))
    first = next(effective, None)
    return Answer(
        episode,
        first.time_s if first is not None else None,
        next(_escalation_ttcs(record, about, episode), None),
    )


def _is_on(record: Record, said: At[Advisory], episode: Episode) -> bool:
    """Whether a message names the hazard and, of a stop line, no other one that is nearer or of the other kind."""
    if not names(said.message, episode.kind):
        return False
    if episode.kind != "stop_line":
        return True
    others = LINES - {episode.stop_kind} if episode.stop_kind in LINES else frozenset[str]()
    return said.message.hazard not in others and not _stops_before(record.truth_at(said.time_s), episode)


def _stops_before(truth: Truth | None, episode: Episode) -> bool:
    """Whether truth has one stop at a line that lies before the episode's."""
    if (
        truth is None
        or truth.stop_kind not in LINES
        or truth.stop_distance_m is None
        or episode.first.distance_m is None
    ):
        return False
    at_m = episode.way_m + episode.first.distance_m
    return truth.distance_m + truth.stop_distance_m < at_m - OTHER_LINE_M


def _in_time(said: At[Advisory], episode: Episode) -> bool:
    """While the hazard is on, or so shortly before that the simulated driver still keeps to what was said."""
    warns = said.message.hazard or said.message.urgency in ESCALATES
    # Of limits many are told: long before a school they are about another place.
    holds_s = WARNING_HOLDS_S if warns or episode.kind in SLOWER else ADVICE_HOLDS_S
    return episode.onset_s - holds_s <= said.time_s <= episode.over_s


def _effective(record: Record, said: At[Advisory], episode: Episode) -> bool:
    """An intervention, or a word early enough for the median driver, who reacts and then halts in the gap as grip and car allow.

    Where the truth tells no distance, or the gap does not close, any word counts. Of a hazard of `SLOWER` a word counts instead
    that asks for less than the ego's speed; before a school none of the topics `limit` and `overspeed` does.
    """
    truth = record.truth_at(said.time_s)
    if truth is None or said.message.kind == "ACT":
        return truth is not None
    gap, closing = distance(truth, episode)
    if episode.kind in SLOWER:
        return _asks_less(said, truth) and (episode.kind != "school_zone" or _of_school(said, gap))
    if gap is None or closing <= 0.0:
        return True
    return median_stop_m(closing, truth) <= gap


def _asks_less(said: At[Advisory], truth: Truth) -> bool:
    told = said.message
    asked = [mps for mps in (told.asked_mps, told.ahead_mps, told.told_limit_mps) if mps is not None]
    return min(asked, default=math.inf) < truth.speed_mps


def _of_school(said: At[Advisory], to_school_m: float | None) -> bool:
    """A limit that is told before the school is another one's; the school's own is `ahead` until one is there."""
    return said.message.topic not in ("limit", "overspeed") or (to_school_m is not None and to_school_m <= 0.0)


def _escalation_ttcs(record: Record, about: list[At[Advisory]], episode: Episode) -> Iterator[float | None]:
    """Times to collision at the escalations, the first one first; the first counts even if the gap did not close."""
    for each in about:
        if each.message.kind == "ACT" or (each.message.urgency in ESCALATES and each.message.hazard):
            truth = record.truth_at(each.time_s)
            yield conflict_s(ttc_s(*distance(truth, episode))) if truth is not None else None


def distance(truth: Truth, episode: Episode) -> tuple[float | None, float]:
    """(gap in m, closing speed in m/s) to a hazard, before its onset too; a gap of None: the truth does not tell it."""
    now = _now(truth, episode)
    body = _body(truth, now or episode.first)
    if body is not None:
        told = now.distance_m if now is not None else None
        return told if told is not None else gap_m(body), -body.vx_mps
    if now is None and episode.first.distance_m is not None:
        return episode.first.distance_m + episode.way_m - truth.distance_m, truth.speed_mps
    return _untold(truth, episode.kind, now.distance_m if now is not None else None)


def _now(truth: Truth, episode: Episode) -> TrueHazard | None:
    """The hazard as truth tells it now, while it is on."""
    return next((each for each in on_now(truth) if (each.kind, each.onset_s) == (episode.kind, episode.onset_s)), None)


def _body(truth: Truth, hazard: TrueHazard) -> TrueActor | None:
    """The road user that is met, if it is near enough to be told."""
    actors = truth.actors if hazard.kind in _OF_A_BODY else ()
    return next((each for each in actors if each.actor_id == hazard.actor_id), None)


def _untold(truth: Truth, kind: str, told_m: float | None) -> tuple[float | None, float]:
    """The same where the truth tells no road user: of the lead, of the person in the path, or of what stands at that distance."""
    if kind in OF_SOMEBODY_AHEAD:
        gap = truth.gap_m if truth.gap_m is not None else told_m
        return gap, truth.closing_mps if truth.closing_mps is not None else truth.speed_mps
    person = person_ahead(truth) if kind == "pedestrian" else None
    if person is not None:
        return gap_m(person), -person.vx_mps
    return told_m, truth.speed_mps
