"""Feedback over a sequence of drives keeps its bounds and does not swing."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.metrics.labels import Drive, Label
from services.arbiter.memory.adapt import STEPS
from services.arbiter.profiles.profile import Profile
from studies.calibrate import __main__ as command
from studies.calibrate.feedback import Moved, sequence, swing
from tests.unit.services.arbiter.support import CALIBRATED

labels = st.builds(Label, st.floats(0.0, 1800.0), st.sampled_from(sorted(STEPS)))
drives = st.builds(Drive, st.lists(labels, max_size=40).map(tuple), st.floats(1800.0, 7200.0))


def run(scripted: Sequence[Drive]) -> list[Moved]:
    return sequence(lambda _, number: scripted[number], CALIBRATED, len(scripted))


@settings(max_examples=60, deadline=None)
@given(st.lists(drives, min_size=1, max_size=20))
def test_no_sequence_of_drives_and_labels_leaves_the_bounds(scripted: list[Drive]) -> None:
    for each in run(scripted):
        assert CALIBRATED.delta_low <= each.delta <= CALIBRATED.delta_high
        assert CALIBRATED.c_min_low <= each.c_min <= CALIBRATED.c_min_high
        assert each.counted <= each.given


@settings(max_examples=60, deadline=None)
@given(drives)
def test_the_same_labels_in_every_drive_lead_to_one_place_without_a_swing(drive: Drive) -> None:
    found = run([drive] * 40)
    for values in ([each.delta for each in found], [each.c_min for each in found]):
        steps = [b - a for a, b in pairwise(values)]
        assert all(step <= 1e-12 for step in steps) or all(step >= -1e-12 for step in steps)
        assert abs(steps[-1]) < 1e-3, "settled"


@settings(max_examples=30, deadline=None)
@given(drives)
def test_drives_without_labels_lead_back(drive: Drive) -> None:
    found = run([drive, *[Drive((), 1800.0)] * 8])
    assert abs(found[-1].delta - CALIBRATED.delta) <= abs(found[0].delta - CALIBRATED.delta) * 1e-3 + 1e-9
    assert abs(found[-1].c_min - CALIBRATED.c_min) <= abs(found[0].c_min - CALIBRATED.c_min) * 1e-3 + 1e-9


def test_a_driver_who_reacts_to_what_feedback_did_does_not_make_it_hunt() -> None:
    """Late as long as Delta is above 0.12, wrong as long as c_min is below 0.6: the worst for hunting, a sharp switch."""

    def driver(profile: Profile, _: int) -> Drive:
        late = ["late_warning"] * 6 if profile.delta > 0.12 else []
        wrong = ["false_positive"] * 6 if profile.c_min < 0.6 else []
        told = [Label(120.0 * at, label) for at, label in enumerate(late + wrong)]
        return Drive(tuple(told), 1800.0)

    found = sequence(driver, CALIBRATED, 40)
    delta, c_min = swing([each.delta for each in found], 0.1), swing([each.c_min for each in found], 0.1)
    assert delta.turns == c_min.turns == 0, "no swing of half the span"
    assert max(delta.late_span, c_min.late_span) <= 0.1


def test_hunting_would_be_seen() -> None:
    assert swing([0.0, 0.4] * 5, 0.1).turns == 8
    assert swing([0.0, 0.1, 0.2, 0.3, 0.2, 0.2], 0.05).turns == 1


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (("--drives", "0"), "argument --drives: '0' is no whole number from 1"),
        (("--svg", "none/feedback.svg"), "there is no folder none"),
        (("--svg", "."), "--svg . is a folder"),
        (("--profile", "nosuch"), "--profile nosuch: No such file or directory; there are calibrated, paper"),
    ],
)
def test_what_the_command_cannot_do_is_told_before_a_drive_is_read(
    wrong: tuple[str, str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (log := tmp_path / "log.mcap").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "load", lambda _: pytest.fail("a drive was read"))
    monkeypatch.setattr("sys.argv", ["calibrate", "feedback", "--from", str(log), *wrong])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2
    assert told in capsys.readouterr().err
