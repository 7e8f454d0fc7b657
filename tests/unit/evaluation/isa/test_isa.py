"""The table of speed assistance: accuracy, delays, the warning tests and what the command refuses."""

from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.units import legal_limit
from drivemcp.cli import main
from evaluation.isa import warnings
from evaluation.isa.accuracy import Accuracy, accuracy
from evaluation.isa.isa import _warning, run_one
from evaluation.isa.table import Outcome, parts, rows
from evaluation.isa.warnings import Warned, verdict
from evaluation.metrics.metrics import Metrics
from evaluation.metrics.record import Record
from evaluation.metrics.speech import words_s
from proto.truth import Truth
from tests.unit.evaluation.metrics.logs import PLAIN, said

KMH = 1 / 3.6


def run(true_kmh: list[int], shown_kmh: Sequence[int | None]) -> Record:
    """A second each at 10 m/s; in the middle of each the limit is shown."""
    truths = [
        Truth(
            **{**PLAIN, "law_limit_mps": limit * KMH},
            time_s=second + step / 10,
            distance_m=10.0 * second + step,
            speed_mps=10.0,
        )
        for second, limit in enumerate(true_kmh)
        for step in range(10)
    ]
    shown = [
        said(float(second), legal_limit=legal_limit(limit, "km/h") if limit is not None else None)
        for second, limit in enumerate(shown_kmh)
    ]
    return Record(truths=tuple(truths), advisories=tuple(shown))


def test_what_is_shown_counts_by_distance_and_by_change() -> None:
    found = accuracy(run([50] * 5 + [30] * 5, [50] * 6 + [30] * 4))
    assert found.metres["all"] == pytest.approx(99.0)
    assert found.right_m["all"] == pytest.approx(89.0)
    assert (found.changes, found.changes_right) == (1, 1)
    assert found.delays_s == pytest.approx((1.0,))


def test_a_limit_that_comes_too_late_or_never_is_no_right_change() -> None:
    late = accuracy(run([50] * 5 + [30] * 5, [50] * 8 + [30] * 2))
    never = accuracy(run([50] * 5 + [30] * 5, [50] * 10))
    assert (late.changes_right, len(late.delays_s)) == (0, 1)
    assert (never.changes_right, never.delays_s) == (0, ())


@given(st.lists(st.tuples(st.sampled_from([30, 50, 100]), st.sampled_from([None, 30, 50, 100])), max_size=12))
def test_no_more_is_right_than_was_driven(seconds: list[tuple[int, int | None]]) -> None:
    found = accuracy(run([true for true, _ in seconds], [shown for _, shown in seconds]))
    assert all(found.right_m[name] <= metres + 1e-6 for name, metres in found.metres.items())
    assert found.changes_right <= len(found.delays_s) <= found.changes


@pytest.mark.parametrize(
    ("speed_kmh", "found", "says"),
    [
        (67, Warned(shown_s=1.1, sounded_s=3.1, sound_s=5.0), "passed"),
        (67, Warned(shown_s=1.1, sounded_s=6.1, sound_s=5.0), "not sounded after 3 to 5 s"),
        (67, Warned(shown_s=4.0, sounded_s=4.1, sound_s=5.0), "shown too late"),
        (67, Warned(shown_s=1.1, sounded_s=3.1, sound_s=9.0), "sounded for too long"),
        (54, Warned(shown_s=1.1, sounded_s=3.0, sound_s=5.0), "not sounded after 6 to 8 s"),
        (51, Warned(shown_s=1.1, sounded_s=9.0), "sounded within the tolerance"),
        (51, Warned(), "passed"),
    ],
)
def test_the_verdict_on_a_warning_test(speed_kmh: int, found: Warned, says: str) -> None:
    assert verdict(speed_kmh, found) == says


def test_a_constant_overspeed_is_sounded_in_time_through_the_whole_stack(tmp_path: Any) -> None:
    found = run_one(str(tmp_path), "k", _warning(67, "model"))
    assert verdict(67, found.warned) == "passed"
    assert msgspec.json.decode((tmp_path / "k.json").read_bytes(), type=Outcome) == found


def test_the_table_has_a_row_for_everything_and_a_dash_for_what_is_not_measured() -> None:
    nothing = Outcome(accuracy=Accuracy(), metrics=Metrics(), warned=Warned())
    for found in ({}, {"urb-rain/test/0": nothing}, {f"isa/warning/{warnings.SPEEDS_KMH[0]}": nothing}):
        table = {what: value for what, value, _ in rows(*parts(found))}
        assert all(table.values())
    assert table["warning tests passed, at constant speed"] == "1 of 1"
    assert table["messages an hour"] == "-"


def test_the_guard_has_no_first_place(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "guard", "--from", "3"])
    assert "--from" in capsys.readouterr().err


def test_words_take_their_time() -> None:
    assert words_s("") == 0.0
    assert words_s("Deep water: ease off, don't brake") == pytest.approx(6 / 2.6)
    assert words_s("Great Britain: keep left, 20 miles an hour") == pytest.approx(8 / 2.6)
