"""The table of kinds of message: whole, and what metrics and arbiter read."""

import pytest

from proto.messages import GRAVER, KINDS, PRESSING, ROWS, Kind, covers
from proto.speech import News
from services.orchestrator.speech.candidate import Candidate
from services.orchestrator.speech.candidates import candidates
from services.orchestrator.state import State
from services.orchestrator.target.target import target


def test_every_kind_has_one_row() -> None:
    assert [row.kind for row in KINDS] == list(ROWS)
    assert set(ROWS) == set(Kind)


def test_a_graver_warning_of_the_same_road_user_covers_a_calmer_one_and_not_the_other_way_round() -> None:
    assert covers("closing_lead", "slow_traffic")
    assert covers("pedestrian", "pedestrian")
    assert not covers("slow_traffic", "closing_lead")
    known = {hazard for row in KINDS for hazard in row.hazards}
    assert {*GRAVER, *(each for found in GRAVER.values() for each in found)} <= known


def test_what_presses_is_known_by_the_topic_under_which_it_goes_out() -> None:
    assert {"person", "stop", "ahead", "give_way"} == PRESSING


def test_candidates_come_in_the_order_of_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    def made(kind: Kind) -> Candidate:
        return Candidate(kind=kind, news=News(), phrase="", urgency="info", values={})

    makers = tuple(lambda *_, kind=row.kind: [made(kind)] for row in reversed(KINDS))
    monkeypatch.setattr(candidates, "MAKERS", makers)
    found = candidates.candidates(State(), target(State()), ())
    assert [each.kind for each in found] == [row.kind for row in KINDS]
