"""What Delta buys and costs, where the arbiter alone decides."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.metrics import Record
from proto import topics
from proto.perception import Tracks
from services.orchestrator.observations.inputs import Method, Observations, Stamped
from studies.calibrate import __main__ as command
from studies.calibrate.bench import APPROACHES, Approach, meet
from studies.calibrate.margins import Decided, approached, as_if_asked, pooled, sheet
from studies.calibrate.recordings import Recording, Step
from tests.unit.services.arbiter.support import CALIBRATED, SECOND, track

NEVER = 1.0
"""A margin that no risk reaches."""


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(APPROACHES), st.floats(0.0, NEVER), st.floats(0.0, NEVER))
def test_who_waits_for_a_larger_margin_never_begins_to_brake_earlier(
    approach: Approach, one: float, other: float
) -> None:
    soon, late = (
        meet(approach, msgspec.structs.replace(CALIBRATED, delta=delta)).braked_ttc_s for delta in sorted((one, other))
    )
    assert late is None or (soon is not None and soon >= late)


def test_a_margin_within_the_papers_brakes_in_every_approach_and_one_beyond_reach_in_none() -> None:
    within, beyond = approached(CALIBRATED, 0.4), approached(CALIBRATED, NEVER)
    assert within.braked == len(APPROACHES)
    assert (beyond.braked, beyond.ttc_s) == (0, None)
    assert within.impact_mps < beyond.impact_mps


def test_drives_are_added_and_told_with_their_interval() -> None:
    one = Decided(km=5.0, interventions=2, false=1, ttcs_s=(1.0, 2.0))
    other = Decided(km=5.0, interventions=1, false=0, ttcs_s=(1.5,))
    # three in 10 km: Garwood's interval is 0.62 to 8.77
    assert pooled([one, other]).cells() == ("3.00 [0.62, 8.77]", "1 of 3", "1.50")
    assert pooled([Decided(km=10.0)]).cells() == ("0.00 [0.00, 3.69]", "0 of 0", "-")


def test_the_table_has_a_line_for_each_margin_and_columns_of_drives_only_where_there_are_some() -> None:
    found = [approached(CALIBRATED, delta) for delta in (0.2, NEVER)]
    alone, beside = sheet(found, []), sheet(found, [Decided(km=1.0), Decided(km=1.0)])
    assert [row[:3] for row in alone.rows[1:]] == [("1", "0 of 9", None)]
    assert {len(alone.columns), *map(len, alone.rows)} == {4}
    assert {len(beside.columns), *map(len, beside.rows)} == {7}


def silent(**fields: object) -> Recording:
    tracks = Stamped(seq=1, stamp_ns=9 * SECOND, message=Tracks(camera="front", frame=1, tracks=(track(),)))
    seen = Observations(now_ns=9 * SECOND + 50_000_000, tracks=tracks, method=Method(name="silent"))
    return Recording("by hand", (Step(9.0, msgspec.structs.replace(seen, **fields), None, None),), {}, Record())


def test_where_nobody_was_told_anything_the_arbiter_reads_what_the_tick_had() -> None:
    (step,) = as_if_asked(silent(), CALIBRATED).steps
    assert step.own is not None
    assert step.own.reading.view.actors == (track(),)
    assert step.own.reading.tracks_age_s == pytest.approx(0.05)
    assert step.own.reading.ego_age_s is None
    assert step.seen.method == Method()


def test_a_topic_that_was_not_valid_then_is_not_read_now() -> None:
    (step,) = as_if_asked(silent(unhealthy=(topics.TRACKS.name,)), CALIBRATED).steps
    assert step.own is not None
    assert step.own.reading.view.actors == ()


def test_a_drive_in_which_the_arbiter_was_asked_stays_as_it_is() -> None:
    asked = silent(method=Method())
    assert as_if_asked(asked, CALIBRATED) == asked


def test_the_command_prints_the_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["calibrate", "margins"])
    assert command.main() == 0
    told = capsys.readouterr().out
    assert "| Delta | approaches braked in |" in told
    assert told.count("\n") == 9
