"""Which messages were true and needed, by hand: said at 10.0 s of 30 s."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.metrics import Record, measure
from evaluation.metrics.precision import TOPICS, precision
from proto.speed_assistance import Picture
from tests.unit.evaluation.metrics.logs import hazard, person, said, truths


def judged(topic: str, what: dict[str, Any], so: dict[str, Any], since_s: float = 0.0) -> tuple[bool, bool] | None:
    """(true, needed) of one message; `so` is how the world is from an instant on; None: not judged."""

    def at(time_s: float) -> dict[str, Any]:
        return {"speed_mps": 15.0, **(so if time_s >= since_s else {})}

    record = Record(truths=truths(30.0, at), advisories=(said(10.0, topic=topic, legal_limit=None, **what),))
    found = precision(record).get(topic)
    return None if found is None else (bool(found.right), bool(found.needed))


PERSON = {"hazard": "pedestrian", "urgency": "warning"}
LEAD = {"hazard": "closing_lead", "urgency": "warning"}
YIELD = {"id": 1.0, "code": "yield", "x_m": 100.0, "y_m": 3.0}
GO = {"picture": Picture(face="green_light")}


@pytest.mark.parametrize(
    ("topic", "what", "so", "since_s", "verdict"),
    [
        ("person", PERSON, {}, 0.0, (False, False)),
        ("person", PERSON, {"actors": (person(35.0, 10.0),)}, 9.5, (True, True)),
        ("person", PERSON, {"actors": (person(35.0, 10.0),)}, 12.0, (False, False)),
        ("person", PERSON, {"actors": (person(55.0, 0.0),)}, 9.5, (True, False)),
        ("lead", LEAD, {"gap_m": 70.0, "closing_mps": 10.0}, 9.5, (False, False)),
        ("lead", LEAD, {"gap_m": 48.0, "closing_mps": 10.0}, 9.5, (True, False)),
        ("lead", LEAD, {"gap_m": 35.0, "closing_mps": 10.0}, 9.5, (True, True)),
        ("lead", LEAD, {"hazards": (hazard("lead_brakes", 10.5),)}, 10.5, (True, True)),
        ("stop", {}, {"stop_kind": "red_light"}, 14.0, (True, False)),
        ("stop", {}, {"stop_kind": "red_light", "speed_mps": 0.0}, 14.0, (True, True)),
        ("stop", {}, {"infraction": "no_stop"}, 19.0, (True, True)),
        ("stop", {}, {"stop_kind": "red_light"}, 21.0, (False, False)),
        ("stop", GO, {"light": "green", "speed_mps": 0.0}, 0.0, (True, True)),
        ("stop", GO, {"light": "red"}, 0.0, (False, False)),
        ("give_way", {}, {"signs": (YIELD,)}, 9.5, (True, False)),
        ("give_way", {}, {"stop_kind": "yield"}, 15.0, (True, True)),
        ("give_way", {}, {"stop_kind": "red_light"}, 15.0, (False, False)),
        ("limit", {"told_limit_mps": 20.0}, {}, 0.0, (True, False)),
        ("limit", {"told_limit_mps": 10.0}, {"law_limit_mps": 10.0}, 11.5, (True, True)),
        ("limit", {"told_limit_mps": 10.0}, {"law_limit_mps": 10.0}, 13.0, (False, False)),
        ("limit", {"target_mps": None}, {}, 0.0, None),
        ("ahead", {"ahead_mps": 10.0}, {"law_limit_mps": 10.0}, 20.0, (True, True)),
        ("ahead", {"ahead_mps": 17.0}, {"law_limit_mps": 17.0}, 20.0, (True, False)),
        ("ahead", {"ahead_mps": 10.0}, {}, 0.0, (False, False)),
        ("border", {}, {"jurisdiction": "FRA"}, 14.0, (True, True)),
        ("border", {}, {"jurisdiction": "FRA"}, 16.0, (False, False)),
        ("friction", {}, {"mu": 0.5}, 0.0, (True, False)),
        ("friction", {}, {"mu": 0.3}, 15.0, (True, True)),
        ("friction", {}, {"hazards": (hazard("deep_water", 15.0),)}, 15.0, (True, True)),
        ("friction", {}, {}, 0.0, (False, False)),
        ("vehicle", {}, {"faults": ("low_tyre",)}, 0.0, (True, True)),
        ("vehicle", {}, {}, 0.0, (False, False)),
        ("vehicle", {}, {"faults": None}, 0.0, None),
        ("foreign", {}, {"signs": ({**YIELD, "code": "limit:70+plate:when_wet:de"},)}, 0.0, (True, True)),
        ("foreign", {}, {"signs": ({**YIELD, "code": "limit:70+plate:when_wet:en"},)}, 0.0, (False, False)),
        ("doubt", {}, {}, 0.0, None),
    ],
)
def test_a_message_is_judged_by_what_is_so(
    topic: str, what: dict[str, Any], so: dict[str, Any], since_s: float, verdict: tuple[bool, bool] | None
) -> None:
    assert judged(topic, what, so, since_s) == verdict


@given(st.lists(st.tuples(st.sampled_from((*TOPICS, "doubt")), st.floats(0.5, 9.0)), max_size=12), st.booleans())
def test_no_more_are_needed_than_true_nor_more_true_than_said(words: list[tuple[str, float]], with_truth: bool) -> None:
    told = tuple(said(time_s, topic=topic) for topic, time_s in sorted(words, key=lambda each: each[1]))
    found = measure(Record(truths=truths(10.0, lambda _: {"speed_mps": 25.0}) if with_truth else (), advisories=told))
    assert sum(found.messages_by_topic.values()) == found.messages == len(words)
    assert bool(found.messages_judged_by_topic) <= with_truth
    for topic, count in found.messages_judged_by_topic.items():
        true, needed = found.messages_true_by_topic[topic], found.messages_needed_by_topic[topic]
        assert needed <= true <= count <= found.messages_by_topic[topic]
