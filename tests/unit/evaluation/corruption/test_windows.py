"""Windows keep their bounds, and together take the share that was asked for."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.corruption.spec import CorruptionSpec
from evaluation.corruption.windows import Window, window_at
from tests.unit.evaluation.corruption.worlds import SECOND, SOME

STEP = SECOND // 20


def windows(spec: CorruptionSpec, share: float, subject: str, seconds: int) -> set[Window]:
    """All windows of a subject."""
    found = (window_at(spec, "dropout", share, subject, at) for at in range(0, seconds * SECOND, STEP))
    return {window for window in found if window is not None}


@SOME
@given(st.floats(0.001, 1.0), st.integers(0, 10**6), st.text(max_size=8))
def test_every_window_is_as_long_as_allowed_and_none_overlap(share: float, seed: int, subject: str) -> None:
    found = sorted(windows(CorruptionSpec(seed=seed), share, subject, 60))
    assert all(0.5 * SECOND <= w.end_ns - w.start_ns <= 3 * SECOND + 1 for w in found)
    gaps = [after.start_ns - before.end_ns for before, after in itertools.pairwise(found)]
    assert all(gap >= 0 for gap in gaps)
    if share <= 0.5:
        assert all(gap >= 0.5 * SECOND - 2 for gap in gaps)


@SOME
@given(st.floats(0.0, 1.0), st.integers(0, 10**6), st.integers(-SECOND, 10**15))
def test_an_instant_is_in_the_window_that_it_is_told(share: float, seed: int, at_ns: int) -> None:
    window = window_at(CorruptionSpec(seed=seed), "freeze", share, "front", at_ns)
    assert window is None or window.start_ns <= at_ns < window.end_ns
    if window is not None:
        assert window_at(CorruptionSpec(seed=seed), "freeze", share, "front", window.end_ns - 1) == window


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.5, 0.8])
def test_the_share_of_time_is_the_one_asked_for(share: float) -> None:
    spec, count = CorruptionSpec(seed=5), 4000
    gone = sum(window_at(spec, "dropout", share, f"actor/{n}", 10 * SECOND) is not None for n in range(count))
    assert abs(gone / count - share) < 4.0 * (share * (1 - share) / count) ** 0.5


@pytest.mark.parametrize(("share", "all_or_none"), [(0.0, False), (1.0, True)])
def test_none_and_all(share: float, all_or_none: bool) -> None:
    instants = range(0, 30 * SECOND, STEP // 7)
    assert {window_at(CorruptionSpec(), "dropout", share, "a", at) is not None for at in instants} == {all_or_none}
