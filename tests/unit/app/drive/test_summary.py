"""The summary, on hand-worked messages."""

import msgspec
import pytest

from app.drive.summary import Tally, percentile, percentiles
from app.drive.words import live_line, summary_lines
from proto.decision import Advisory
from proto.health import ServiceHealth, TopicHealth
from proto.rules import LegalLimit
from proto.tools import CallRecord, CallRecords
from proto.truth import ScenarioState, Truth


def truth(time_s: float, **fields: object) -> Truth:
    """An instant at 15 m/s where 10 m/s are allowed, unless told otherwise."""
    base: dict[str, object] = {
        "time_s": time_s, "distance_m": 15.0 * time_s, "speed_mps": 15.0, "acceleration_mps2": 0.0, "law_limit_mps": 10.0,
        "jurisdiction": "DEU", "mu": 0.5, "gap_m": 30.0, "closing_mps": 10.0,
    }  # fmt: skip
    return Truth(**{**base, **fields})  # type: ignore[arg-type]


def advisory(kind: str = "SILENT", **fields: object) -> Advisory:
    """An advisory."""
    base: dict[str, object] = {
        "tick": 1, "snapshot_stamp_ns": 0, "kind": kind, "directive": "Slow to 50 km/h", "justification": "", "urgency": "advice",
        "topic": "limit", "hazard": "", "target_mps": 13.9, "legal_limit": LegalLimit(value=50, unit="km/h", mps=13.9),
        "unit": "km/h", "language": "en", "confidence": 0.9,
    }  # fmt: skip
    return Advisory(**{**base, **fields})  # type: ignore[arg-type]


def test_overspeed_is_the_mean_share_above_the_true_limit() -> None:
    tally = Tally()
    tally.add_truth(truth(0.0))
    tally.add_truth(truth(1.0, speed_mps=10.0))
    assert tally.summary().overspeed_pct == pytest.approx(25.0)


def test_a_hazard_is_answered_by_the_first_word_about_it_and_its_ttc_is_gap_over_closing() -> None:
    tally = Tally()
    tally.add_truth(truth(4.0, hazard="pedestrian", hazard_onset_s=4.0))
    tally.add_advisory(advisory("SPEAK", urgency="advice"))
    tally.add_truth(truth(4.5, hazard="pedestrian", hazard_onset_s=4.0))
    tally.add_advisory(advisory("SPEAK", urgency="warning", hazard="pedestrian", topic="person"))
    tally.add_truth(truth(5.0, hazard="pedestrian", hazard_onset_s=4.0))
    tally.add_advisory(advisory("SPEAK", urgency="alarm", hazard="pedestrian"))
    summary = tally.summary()
    assert summary.hazard_response_s == [0.5]
    assert summary.ttc_first_warning_s == pytest.approx(3.0)


def test_silence_messages_withheld_acts_and_misses_are_counted() -> None:
    tally = Tally()
    for kind in ("SILENT", "SILENT", "SILENT", "SPEAK"):
        tally.add_advisory(advisory(kind))
    tally.add_advisory(advisory("SPEAK", act_withheld="no grant"))
    record = CallRecord(
        call_id="1", caller="orchestrator", tool="applicable_limit", side="caller", sent_ns=0, done_ns=1, status="timeout",
        arguments_sha256="",
    )  # fmt: skip
    tally.add_calls(CallRecords(records=(record,)))
    summary = tally.summary()
    assert summary.silent_share == pytest.approx(0.6)
    assert (summary.messages, summary.acts_withheld, summary.acts_done) == (2, 1, 0)
    assert summary.deadline_misses == {"applicable_limit": 1}


def test_a_word_about_another_thing_answers_no_hazard() -> None:
    tally = Tally()
    tally.add_truth(truth(4.0, hazard="pedestrian", hazard_onset_s=4.0))
    tally.add_advisory(advisory("SPEAK", urgency="alarm", hazard="closing_lead", topic="lead"))
    assert tally.summary().hazards == 1
    assert tally.summary().hazard_response_s == []


@pytest.mark.parametrize(("said_s", "responses"), [(5.0, [0.0]), (0.5, [])])
def test_who_was_warned_just_before_the_onset_is_warned_and_long_before_is_not(
    said_s: float, responses: list[float]
) -> None:
    tally = Tally()
    tally.add_truth(truth(said_s))
    tally.add_advisory(advisory("SPEAK", urgency="warning", hazard="closing_lead", topic="lead"))
    tally.add_truth(truth(6.0, hazard="priority", hazard_onset_s=6.0))
    assert tally.summary().hazard_response_s == responses


def test_one_infraction_that_lasts_is_counted_once() -> None:
    tally = Tally()
    for time_s, infraction in enumerate(["", "speeding", "speeding", "", "speeding"]):
        tally.add_truth(truth(float(time_s), infraction=infraction))
    assert tally.summary().infractions == {"speeding": 2}


def test_nothing_known_is_said_to_be_unknown_and_not_zero() -> None:
    summary = Tally().summary()
    assert summary.distance_m is None
    assert summary.infractions is None
    text = "\n".join(summary_lines(summary))
    assert "unknown" in text


def test_the_live_line_shows_speed_limit_target_and_advice_in_the_drivers_unit() -> None:
    tally = Tally()
    tally.add_truth(truth(1.0))
    tally.add_advisory(advisory("SPEAK"))
    line = live_line(tally)
    assert " 54 km/h" in line
    assert "limit 50" in line
    assert "target 50" in line
    assert "Slow to 50 km/h" in line
    tally.add_truth(truth(4.5))
    tally.add_advisory(advisory("SILENT", directive=""))
    assert "Slow to 50 km/h (4 s ago)" in live_line(tally), "the last advice stays to be read"


@pytest.mark.parametrize(
    ("limit", "why", "shown"),
    [
        (LegalLimit(value=50, unit="km/h", mps=13.9, assumed=True), "law", "limit 50? | target 50?"),
        (LegalLimit(value=50, unit="km/h", mps=13.9, assumed=True), "lead", "limit 50? | target 50 |"),
        (None, "law", "limit ? | target ? |"),
        (None, "lead", "limit ? | target 50 |"),
    ],
)
def test_a_target_that_rests_on_an_assumed_limit_has_a_question_mark_and_on_none_that_is_shown_no_number(
    limit: LegalLimit | None, why: str, shown: str
) -> None:
    tally = Tally()
    tally.add_advisory(advisory(legal_limit=limit, target_why=why))
    assert shown in live_line(tally)


def test_a_recordings_time_is_the_players() -> None:
    tally = Tally()
    clip = ScenarioState(scenario="clip", seed=0, time_s=4.2, duration_s=9.0, running=True)
    tally.scenario = clip
    tally.add_advisory(advisory("SPEAK"))
    tally.scenario = msgspec.structs.replace(clip, time_s=7.5)
    assert live_line(tally).startswith("  7.5 s")
    assert "(3 s ago)" in live_line(tally)
    assert tally.spoken[0][0] == 4.2


def test_percentiles_are_nearest_rank() -> None:
    assert percentiles([float(i) for i in range(1, 101)]).p50 == 50.0
    assert percentiles([float(i) for i in range(1, 101)]).p99 == 99.0
    assert percentiles([]).p50 is None


@pytest.mark.parametrize(
    ("count", "p50", "p99"), [(1, 1, 1), (2, 1, 2), (3, 2, 3), (100, 50, 99), (101, 51, 100), (700, 350, 693)]
)
def test_a_percentile_is_the_least_value_that_so_large_a_share_does_not_exceed(count: int, p50: int, p99: int) -> None:
    values = list(range(count, 0, -1))
    assert (percentile(values, 0.5), percentile(values, 0.99), percentile(values, 1.0)) == (p50, p99, count)
    assert percentile(values, 0.0) == 1


def test_what_did_not_reach_the_logger_is_told_by_its_own_count() -> None:
    tally = Tally()
    for service, lost in (("logger", 3), ("logger", 5), ("can", 70)):
        topic = TopicHealth(topic="can/ego", alive=True, on_rate=True, valid=True, lost=lost)
        tally.add_health(ServiceHealth(service=service, pid=1, uptime_s=1.0, rss_mb=1.0, topics=(topic, topic)))
    assert tally.summary().log_missed == 10
    assert "10 messages did not reach the logger" in "\n".join(summary_lines(tally.summary()))
    assert Tally().summary().log_missed == 0
