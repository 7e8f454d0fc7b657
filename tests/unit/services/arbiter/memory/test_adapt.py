"""Feedback moves Delta and c_min within bounds, and wears off."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.decision import Feedback
from services.arbiter.memory import store
from services.arbiter.memory.adapt import STEPS, is_within_bounds, learn, relax, within_bounds
from services.arbiter.state import Adapted, Owed
from tests.unit.services.arbiter.support import CALIBRATED, PAPER, SECOND

START = Adapted(delta=CALIBRATED.delta, c_min=CALIBRATED.c_min, updated_ns=0)
labels = st.lists(st.sampled_from(sorted(STEPS)).map(lambda label: Feedback(label=label)), max_size=60)  # type: ignore[arg-type]


def test_a_late_warning_makes_the_car_act_sooner_and_a_false_one_later() -> None:
    late = learn(START, (Feedback(label="late_warning"),), CALIBRATED)
    false = learn(START, (Feedback(label="false_positive"),), CALIBRATED)
    assert late.delta == START.delta - CALIBRATED.k_late
    assert late.c_min == START.c_min
    assert false.c_min == START.c_min + CALIBRATED.k_fp


@given(labels)
def test_no_sequence_of_labels_leaves_the_bounds(feedback: list[Feedback]) -> None:
    after = learn(START, tuple(feedback), CALIBRATED)
    assert CALIBRATED.delta_low <= after.delta <= CALIBRATED.delta_high
    assert CALIBRATED.c_min_low <= after.c_min <= CALIBRATED.c_min_high


@given(labels, st.floats(0.0, 1e5))
def test_time_only_leads_back_to_the_calibrated_values(feedback: list[Feedback], seconds: float) -> None:
    moved = learn(START, tuple(feedback), CALIBRATED)
    later = relax(moved, int(seconds * SECOND), CALIBRATED)
    assert abs(later.delta - CALIBRATED.delta) <= abs(moved.delta - CALIBRATED.delta) + 1e-12
    assert abs(later.c_min - CALIBRATED.c_min) <= abs(moved.c_min - CALIBRATED.c_min) + 1e-12


def test_many_labels_end_at_the_bounds() -> None:
    late = learn(START, (Feedback(label="late_warning"),) * 50, CALIBRATED)
    false = learn(START, (Feedback(label="false_positive"),) * 50, CALIBRATED)
    assert (late.delta, false.c_min) == (CALIBRATED.delta_low, CALIBRATED.c_min_high)


def test_half_an_hour_forgets_most() -> None:
    moved = learn(START, (Feedback(label="late_warning"),) * 5, CALIBRATED)
    later = relax(moved, 1800 * SECOND, CALIBRATED)
    assert 0.36 < (CALIBRATED.delta - later.delta) / (CALIBRATED.delta - moved.delta) < 0.38


def test_it_is_kept_between_drives_under_its_own_profile_only(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "arbiter.json"
    store.save(file, Adapted(delta=0.1, c_min=0.6), CALIBRATED)
    assert store.load(file, CALIBRATED).delta == 0.1
    assert store.load(file, PAPER).delta == PAPER.delta


def test_a_damaged_or_impossible_file_counts_for_nothing(tmp_path: Path) -> None:
    file = tmp_path / "arbiter.json"
    for content in (b"", b"{", b'{"profile":"\xff"}', b'{"profile":"calibrated","delta":-9,"c_min":0.5}'):
        file.write_bytes(content)
        assert store.load(file, CALIBRATED).delta == CALIBRATED.delta


drives = st.lists(
    st.tuples(st.lists(st.sampled_from(sorted(STEPS)), max_size=20), st.floats(60.0, 7200.0)), max_size=20
)


@settings(max_examples=40, deadline=None)
@given(drives)
def test_no_sequence_of_drives_kept_in_its_file_leaves_the_bounds(
    tmp_path_factory: pytest.TempPathFactory, scripted: list[tuple[list[str], float]]
) -> None:
    file = tmp_path_factory.mktemp("car") / "arbiter.json"
    for given_labels, seconds in scripted:
        adapted = relax(store.load(file, CALIBRATED), 0, CALIBRATED)
        adapted = learn(adapted, tuple(Feedback(label=label) for label in given_labels), CALIBRATED)  # type: ignore[arg-type]
        store.save(file, relax(adapted, int(seconds * SECOND), CALIBRATED), CALIBRATED)
        kept = store.load(file, CALIBRATED)
        assert CALIBRATED.delta_low <= kept.delta <= CALIBRATED.delta_high
        assert CALIBRATED.c_min_low <= kept.c_min <= CALIBRATED.c_min_high


def test_the_pause_between_two_drives_forgets_nothing_and_driving_does(tmp_path: Path) -> None:
    file = tmp_path / "arbiter.json"
    store.save(file, Adapted(delta=0.1, c_min=0.6), CALIBRATED)
    days_later = relax(store.load(file, CALIBRATED), 10**15, CALIBRATED)
    assert days_later.delta == 0.1
    assert relax(days_later, 10**15 + 1800 * SECOND, CALIBRATED).delta > 0.15


def test_what_was_braked_outlives_a_restart_and_another_profile(tmp_path: Path) -> None:
    file, owed = tmp_path / "arbiter.json", Owed(braked_s=3.0, rests=True)
    store.save(file, Adapted(delta=0.1, c_min=0.6), CALIBRATED, owed)
    assert store.load_owed(file) == owed
    assert store.load_owed(tmp_path / "absent.json") == Owed()


def test_each_label_moves_by_its_own_steps() -> None:
    def moved(label: str) -> tuple[float, float]:
        after = learn(START, (Feedback(label=label),), CALIBRATED)  # type: ignore[arg-type]
        return after.delta - START.delta, after.c_min - START.c_min

    late, wrong = CALIBRATED.k_late, CALIBRATED.k_fp
    assert moved("late_warning") == pytest.approx((-late, 0.0))
    assert moved("false_positive") == moved("override") == pytest.approx((0.0, wrong))
    assert moved("annoying") == pytest.approx((0.0, wrong / 2.0))
    assert moved("helpful") == (0.0, 0.0)


def test_values_relax_from_the_first_look_on_and_by_no_clock_that_goes_back() -> None:
    begun = relax(Adapted(delta=0.1, c_min=0.7), 5 * SECOND, CALIBRATED)
    assert begun == Adapted(delta=0.1, c_min=0.7, updated_ns=5 * SECOND)
    assert relax(begun, 4 * SECOND, CALIBRATED) == begun
    assert relax(begun, 5 * SECOND, CALIBRATED) == begun
    kept = math.exp(-100.0 / CALIBRATED.relax_s)
    later = relax(begun, 105 * SECOND, CALIBRATED)
    assert later.delta == pytest.approx(CALIBRATED.delta + (0.1 - CALIBRATED.delta) * kept)
    assert later.c_min == pytest.approx(CALIBRATED.c_min + (0.7 - CALIBRATED.c_min) * kept)
    assert later.updated_ns == 105 * SECOND


@pytest.mark.parametrize(
    ("delta", "c_min", "within"),
    [
        (0.0, 0.4, True), (0.4, 0.8, True), (-0.01, 0.5, False), (0.41, 0.5, False), (0.2, 0.39, False), (0.2, 0.81, False),
    ],
)  # fmt: skip
def test_what_lies_outside_the_bounds_is_calibrated_again(delta: float, c_min: float, within: bool) -> None:
    stored = Adapted(delta=delta, c_min=c_min, updated_ns=7)
    assert is_within_bounds(stored, CALIBRATED) is within
    told = Adapted(delta=delta, c_min=c_min) if within else Adapted(delta=CALIBRATED.delta, c_min=CALIBRATED.c_min)
    assert within_bounds(stored, CALIBRATED) == told


def test_a_file_gives_back_both_values_and_its_words_are_readable(tmp_path: Path) -> None:
    file = tmp_path / "arbiter.json"
    store.save(file, Adapted(delta=0.1, c_min=0.6, updated_ns=7), CALIBRATED, Owed(braked_s=2.0))
    assert store.load(file, CALIBRATED) == Adapted(delta=0.1, c_min=0.6)
    assert json.loads(file.read_text())["profile"] == "calibrated"
    assert [each.name for each in tmp_path.iterdir()] == ["arbiter.json"]
    calibrated = Adapted(delta=PAPER.delta, c_min=PAPER.c_min)
    assert store.load(file, PAPER) == calibrated
    assert store.load(tmp_path / "absent.json", PAPER) == calibrated
    store.save(file, Adapted(delta=0.1, c_min=0.6), CALIBRATED)
    assert store.load_owed(file) == Owed()
