"""What holds of the metrics of any run."""

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.metrics import Record, measure
from tests.unit.evaluation.metrics.logs import decided, hazard, limit, person, said, ticked, truths

SPEEDS = st.floats(0.0, 50.0)
INSTANTS = st.fixed_dictionaries(
    {
        "speed_mps": SPEEDS,
        "law_limit_mps": st.none() | st.floats(5.0, 40.0),
        "mu": st.floats(0.05, 1.0),
        "gap_m": st.none() | st.floats(0.0, 200.0),
        "closing_mps": st.none() | st.floats(-20.0, 40.0),
        "collision": st.booleans(),
        "infraction": st.sampled_from(("", "red_light", "no_stop", "wrong_yield", "illegal_turn", "speeding")),
        "hazards": st.sampled_from(((), (hazard("pedestrian", 0.5),), (hazard("cut_in", 1.0, 0.0),))),
        "actors": st.sampled_from(((), (person(30.0, 10.0),), (person(2.0, -1.0, in_path=False),))),
        "stop_kind": st.sampled_from(("", "red_light")),
        "stop_distance_m": st.none() | st.floats(-3.0, 80.0),
        "visibility_m": st.none() | st.floats(10.0, 20_000.0),
    }
)
MESSAGES = st.fixed_dictionaries(
    {
        "kind": st.sampled_from(("SILENT", "SPEAK", "ACT")),
        "topic": st.sampled_from(("limit", "lead", "person", "ahead")),
        "hazard": st.sampled_from(("", "closing_lead", "pedestrian")),
        "urgency": st.sampled_from(("info", "advice", "warning", "alarm")),
        "target_mps": st.none() | SPEEDS,
        "legal_limit": st.none() | st.builds(limit, st.floats(5.0, 40.0), st.booleans()),
    }
)


@settings(max_examples=30, deadline=None)
@given(st.lists(INSTANTS, min_size=1, max_size=12), st.lists(MESSAGES, max_size=12), st.booleans())
def test_any_run_is_measured_and_parts_never_exceed_wholes(
    instants: list[dict[str, Any]], messages: list[dict[str, Any]], with_truth: bool
) -> None:
    truth = truths(0.5 * len(instants), lambda t: instants[min(len(instants) - 1, int(t / 0.5))])
    told = tuple(said(0.5 * at, **what) for at, what in enumerate(messages, 1))
    decisions = tuple(decided(each.time_s, each.message.kind) for each in told)
    traces = tuple(ticked(each.time_s, ("overspeed",), ("applicable_limit",)) for each in told)
    found = measure(Record(truths=truth if with_truth else (), advisories=told, decisions=decisions, traces=traces))
    assert (found.repeats_20s or 0) <= found.messages
    assert found.nags <= found.messages <= found.ticks == len(messages)
    assert found.correct_tool_rate is None or 0.0 <= found.correct_tool_rate <= 1.0
    assert found.event_f1 is None or 0.0 <= found.event_f1 <= 1.0
    if not with_truth:
        assert found.infractions is None
        return
    assert (found.false_while_hazard or 0) <= (found.false_interventions or 0) <= found.interventions
    untold, illegal = found.infractions_untold or 0, (found.infractions or {})["illegal_turn"]
    assert untold + found.infractions_by_cause["told in time"] + illegal == found.infractions_total
    assert (found.rss_unanswered or 0) <= (found.rss_violations or 0)
    assert sum(found.hazards_by_kind.values()) == found.hazards
    assert sum(found.hazards_answered_by_kind.values()) == found.hazards_answered
    assert sorted(sum(found.hazard_response_by_kind_s.values(), ())) == sorted(found.hazard_response_s)
    assert found.event_f1_without_law is None or 0.0 <= found.event_f1_without_law <= 1.0
    answered = len(found.hazard_response_s) + (found.hazards_answered_before or 0)
    assert found.hazards_answered == answered <= (found.hazards or 0)
    assert (found.near_collisions_pet or 0) <= (found.near_collisions or 0)
    assert found.collisions in (0, 1)
    assert all(value >= 0.0 for value in (*found.hazard_response_s, *found.ttc_escalation_s, *found.ttc_intervention_s))
    assert (found.wrong_limit_s or 0.0) + (found.unknown_limit_s or 0.0) <= found.seconds + 1e-6
    assert (found.overspeed_true_pct or 0.0) >= 0.0
