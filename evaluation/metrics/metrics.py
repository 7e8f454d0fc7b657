"""All metrics of one run. Counts come with what they are counted over, so that runs can be pooled; see `evaluation.statistics`."""

from collections import Counter
from collections.abc import Iterable, Mapping

import msgspec

from evaluation.metrics import comfort, conflicts, hazards, law, precision, speech, told, understanding
from evaluation.metrics.record import Record
from evaluation.metrics.understanding import Scores
from proto.truth import Corrupted


class Metrics(msgspec.Struct, frozen=True, kw_only=True):
    """One run's numbers. None: could not be measured (no truth, nothing of the kind in the run)."""

    distance_m: float | None = None
    """Distance driven, m; truth."""
    seconds: float = 0.0
    """Duration, s; truth, or without it the messages."""
    ticks: int = 0
    """Advisories, silent ones included."""

    signs_drawn: int = 0
    """Encounters with signs for which a corruption drew whether to miss or misread them."""
    signs_corrupted: int = 0
    """Of them, those that it did."""

    infractions: dict[str, int] | None = None
    """Count by type: `speeding`, `failure_to_stop`, `wrong_yielding`, `illegal_turn`; truth and the law in force."""
    infractions_total: int | None = None
    """Their sum."""
    infractions_by_cause: dict[str, int] = {}
    """Of them, but for illegal turns: `told in time`, `told late`, `told wrongly`, `not told`; truth, advisories."""
    infractions_untold: int | None = None
    """Those that the system told late, wrongly or not at all."""
    overspeed_inferred_pct: float | None = None
    """Mean share above the inferred limit, %; truth's speed, the advisory's limit. The paper's overspeed."""
    overspeed_true_pct: float | None = None
    """The same against the true limit, %; truth."""

    hazards: int | None = None
    """True hazards; truth."""
    hazards_answered: int | None = None
    """Of them, those with an effective warning or intervention; truth, advisories."""
    hazards_met_untold: int | None = None
    """Of those not answered, those that the driver met without infraction, contact or hard braking: no word was due; truth."""
    hazard_response_s: tuple[float, ...] = ()
    """Onset to the first effective warning or intervention, s, of each that had none before its onset."""
    hazards_answered_before: int | None = None
    """Of those answered, those with an effective word before the onset: they have no response."""
    hazards_by_kind: dict[str, int] = {}
    """The hazards by kind."""
    hazards_answered_by_kind: dict[str, int] = {}
    """Those answered, by the same kinds."""
    hazard_response_by_kind_s: dict[str, tuple[float, ...]] = {}
    """The responses, s, by the same kinds."""
    ttc_escalation_s: tuple[float, ...] = ()
    """True time to collision at the first escalation of each hazard at which the gap was closing, s."""
    ttc_intervention_s: tuple[float, ...] = ()
    """True time to collision at the start of each intervention, s."""

    advisory_latency_s: tuple[float, ...] = ()
    """Event detection to advice of each tick in which an event began and something was said, s; the advisory's own."""
    sensor_latency_p50_s: float | None = None
    """Picture to advice, median, s; the advisory's own."""
    sensor_latency_p99_s: float | None = None
    """The same, 99th percentile."""

    headway_median_s: float | None = None
    """Gap over speed while following (4 s or less, 5 m/s or more), s; truth."""
    headway_short_share: float | None = None
    """Share of that time below 1 s."""

    events: dict[str, Scores] = {}
    """By kind: detected events (traces) against those derived from truth."""
    event_f1: float | None = None
    """Of all kinds together (micro-averaged), 0 to 1."""
    event_f1_without_law: float | None = None
    """The same without `overspeed`, which takes a rules service, 0 to 1."""
    tool_ticks: int = 0
    """Ticks judged for their tools; traces."""
    tool_ticks_right: int = 0
    """Of them, those with the right tools."""
    correct_tool_rate: float | None = None
    """Their share, 0 to 1."""

    interventions: int = 0
    """Stretches of ACT that was carried out; decisions."""
    false_interventions: int | None = None
    """Of them, those about whose start truth shows no RSS violation."""
    false_while_hazard: int | None = None
    """Of these, those that begin while a true hazard is on."""
    rss_violations: int | None = None
    """Stretches in which truth violates RSS; those less than 2 s apart are one; truth."""
    rss_unanswered: int | None = None
    """Of them, those with no intervention under way in them or within 1 s before; truth, decisions."""
    near_collisions: int | None = None
    """Encounters with a time to collision below 1.5 s or a post-encroachment time below 1 s, and no collision; truth."""
    near_collisions_pet: int | None = None
    """Of them, those by post-encroachment time alone."""
    contact_speed_mps: tuple[float, ...] = ()
    """The ego's speed when it began to touch a road user, m/s; truth."""
    collisions: int | None = None
    """0 or 1; truth."""

    messages: int = 0
    """Messages that the driver hears; advisories."""
    messages_by_topic: dict[str, int] = {}
    """The same by topic."""
    messages_judged_by_topic: dict[str, int] = {}
    """Those of which truth can tell; truth."""
    messages_true_by_topic: dict[str, int] = {}
    """Of them, those that were true."""
    messages_needed_by_topic: dict[str, int] = {}
    """Of the true ones, those on which something depended."""
    listening_s: float | None = None
    """Time in which the driver listens, s: by the words of the messages."""
    cut_off: int | None = None
    """Messages that the next one cut off before their last word."""
    nags: int = 0
    """Repeats without new information."""
    repeats_20s: int | None = None
    """Messages in the words of another one within 20 s before."""
    false_warnings: int | None = None
    """Warnings of a vehicle or a person ahead that truth does not know."""
    wrong_limit_s: float | None = None
    """Time with another limit than the true one, s; advisories, truth."""
    unknown_limit_s: float | None = None
    """Time in which the true limit was not known at all, s."""
    target_above_law_s: float | None = None
    """Time with a target above the true limit, s; advisories, truth."""
    unnecessary_slow_downs: int | None = None
    """Slow-downs after a message for which truth knows no cause."""
    target_mean_mps: float | None = None
    """Mean recommended speed, m/s; advisories."""

    hardest_braking_mps2: float | None = None
    """Largest mean deceleration over half a second, m/s^2; truth."""
    hard_brakings: int | None = None
    """Times beyond 3.5 m/s^2."""
    jerk_rms_mps3: float | None = None
    """Root mean square of the change of acceleration over half a second, m/s^3; truth."""


OF_LAW = frozenset({"overspeed"})
"""Events that only a method with a rules service can detect: the Direct ones have none."""


def _known(values: Iterable[float | None]) -> tuple[float, ...]:
    return tuple(value for value in values if value is not None)


def _answered(answers: Iterable[hazards.Answer]) -> int:
    return sum(each.at_s is not None for each in answers)


def _total(scores: Mapping[str, Scores]) -> Scores:
    rows = scores.values()
    return Scores(
        hit=sum(row.hit for row in rows), missed=sum(row.missed for row in rows), false=sum(row.false for row in rows)
    )


def _signs(record: Record) -> list[Corrupted]:
    return [each.message for each in record.corrupted if each.message.kind in ("sign_miss", "limit_misread")]


def _seconds(record: Record) -> float:
    if record.truths:
        return record.truths[-1].time_s
    return record.advisories[-1].time_s if record.advisories else 0.0


class RateRow(msgspec.Struct, frozen=True, kw_only=True):
    """A count, what it is counted over, and the amount of that which the rate is told for."""

    count: str
    exposure: str
    per: float
    unit: str


RATES: Mapping[str, RateRow] = {
    name: RateRow(count=count, exposure=exposure, per=per, unit=unit)
    for name, count, exposure, per, unit in (
        ("infractions", "infractions_total", "distance_m", 1e4, "/10 km"),
        ("infractions_untold", "infractions_untold", "distance_m", 1e4, "/10 km"),
        ("interventions", "interventions", "distance_m", 1e4, "/10 km"),
        ("false_interventions", "false_interventions", "distance_m", 1e6, "/1,000 km"),
        ("rss_violations", "rss_violations", "distance_m", 1e4, "/10 km"),
        ("rss_unanswered", "rss_unanswered", "distance_m", 1e4, "/10 km"),
        ("near_collisions", "near_collisions", "distance_m", 1e4, "/10 km"),
        ("collisions", "collisions", "distance_m", 1e6, "/1,000 km"),
        ("messages", "messages", "distance_m", 1e4, "/10 km"),
        ("messages_hour", "messages", "seconds", 3600.0, "/h"),
        ("listening", "listening_s", "seconds", 3600.0, "s/h"),
        ("cut_off", "cut_off", "distance_m", 1e4, "/10 km"),
        ("nags", "nags", "distance_m", 1e4, "/10 km"),
        ("repeats_20s", "repeats_20s", "distance_m", 1e4, "/10 km"),
        ("false_warnings", "false_warnings", "distance_m", 1e4, "/10 km"),
        ("unnecessary_slow_downs", "unnecessary_slow_downs", "distance_m", 1e4, "/10 km"),
        ("hard_brakings", "hard_brakings", "distance_m", 1e4, "/10 km"),
        ("wrong_limit", "wrong_limit_s", "seconds", 3600.0, "s/h"),
        ("unknown_limit", "unknown_limit_s", "seconds", 3600.0, "s/h"),
        ("target_above_law", "target_above_law_s", "seconds", 3600.0, "s/h"),
    )
}
"""Rates made of the counts of one run or of many.

`listening`, `wrong_limit`, `unknown_limit` and `target_above_law` are times, not counts: no Poisson interval fits them.
"""


def measure(record: Record) -> Metrics:
    """The numbers of a run."""
    detected = understanding.detected(record)
    right, judged = understanding.tool_ticks(record)
    signs = _signs(record)
    braked = conflicts.interventions(record)
    without_truth = Metrics(
        seconds=_seconds(record),
        ticks=len(record.advisories),
        signs_drawn=len(signs),
        signs_corrupted=sum(each.hit for each in signs),
        advisory_latency_s=speech.advisory_latencies_s(record),
        sensor_latency_p50_s=speech.percentile(speech.sensor_latencies_s(record), 50),
        sensor_latency_p99_s=speech.percentile(speech.sensor_latencies_s(record), 99),
        interventions=len(braked),
        messages=len(record.spoken),
        messages_by_topic=dict(Counter(each.message.topic for each in record.spoken)),
        listening_s=speech.listening_s(record),
        cut_off=speech.cut_off(record),
        nags=speech.nags(record),
        repeats_20s=speech.repeats(record),
        target_mean_mps=speech.mean_target_mps(record),
    )
    if not record.truths:
        return without_truth
    kinds = law.infractions(record)
    causes = told.causes(record)
    answers = hazards.answers(record)
    by_kind = hazards.by_kind(answers)
    false = [each for each in braked if conflicts.is_false(record, each)]
    judged_by = precision.precision(record)
    by_ttc, by_pet = conflicts.near_collisions(record)
    return msgspec.structs.replace(
        without_truth,
        distance_m=record.truths[-1].distance_m,
        infractions=kinds,
        infractions_total=sum(kinds.values()),
        infractions_by_cause=dict(causes),
        infractions_untold=sum(causes.values()) - causes["told in time"],
        overspeed_inferred_pct=law.overspeed_inferred_pct(record),
        overspeed_true_pct=law.overspeed_true_pct(record),
        hazards=len(answers),
        hazards_answered=_answered(answers),
        hazards_met_untold=hazards.met_untold(record, answers),
        hazards_answered_before=sum(each.before for each in answers),
        hazard_response_s=_known(each.response_s for each in answers),
        hazards_by_kind={kind: len(each) for kind, each in by_kind.items()},
        hazards_answered_by_kind={kind: _answered(each) for kind, each in by_kind.items()},
        hazard_response_by_kind_s={
            kind: _known(answer.response_s for answer in each) for kind, each in by_kind.items()
        },
        ttc_escalation_s=_known(each.ttc_s for each in answers),
        ttc_intervention_s=_known(conflicts.nearest_ttc_at(record, each.from_s) for each in braked),
        headway_median_s=conflicts.headway_median_s(record),
        headway_short_share=conflicts.short_headway_share(record),
        events=detected,
        event_f1=_total(detected).f1,
        event_f1_without_law=_total({kind: row for kind, row in detected.items() if kind not in OF_LAW}).f1,
        tool_ticks=judged,
        tool_ticks_right=right,
        correct_tool_rate=right / judged if judged else None,
        false_interventions=len(false),
        false_while_hazard=sum(hazards.any_on(record, each.from_s) for each in false),
        rss_violations=len(conflicts.rss_violations(record)),
        rss_unanswered=len(conflicts.rss_unanswered(record)),
        near_collisions=by_ttc + by_pet,
        near_collisions_pet=by_pet,
        collisions=conflicts.collisions(record),
        contact_speed_mps=conflicts.contact_speed_mps(record),
        messages_judged_by_topic={topic: each.judged for topic, each in judged_by.items()},
        messages_true_by_topic={topic: each.right for topic, each in judged_by.items()},
        messages_needed_by_topic={topic: each.needed for topic, each in judged_by.items()},
        false_warnings=speech.false_warnings(record),
        wrong_limit_s=law.wrong_limit_s(record),
        unknown_limit_s=law.unknown_limit_s(record),
        target_above_law_s=law.target_above_law_s(record),
        unnecessary_slow_downs=speech.unnecessary_slow_downs(record),
        hardest_braking_mps2=comfort.hardest_braking_mps2(record),
        hard_brakings=comfort.hard_brakings(record),
        jerk_rms_mps3=comfort.jerk_rms_mps3(record),
    )
