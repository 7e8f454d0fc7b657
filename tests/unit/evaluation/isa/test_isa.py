"""The table of speed assistance: accuracy, delays, the warning tests and what the command refuses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.units import legal_limit
from drivemcp.cli import main
from evaluation.isa import warnings
from evaluation.isa.accuracy import Accuracy, accuracy
from evaluation.isa.capabilities import DRIVES, RAIN, capabilities, scenario, understood
from evaluation.isa.isa import _past, _warning, run_one
from evaluation.isa.table import Outcome, parts, rows
from evaluation.isa.warnings import Moment, Warned, WarningTest, overspeeds, verdict, warned
from evaluation.metrics.metrics import Metrics
from evaluation.metrics.record import Record
from evaluation.metrics.speech import words_s
from proto.speed_assistance import SpeedAssistance
from proto.truth import Truth
from services.simulator.scenario.law import build_law
from tests.unit.evaluation.metrics.logs import PLAIN, said

KMH = 1 / 3.6


def assisted(
    warning: str = "none", limit_kmh: float | None = 50.0, speed_kmh: float = 60.0, **what: Any
) -> SpeedAssistance:
    limit = legal_limit(limit_kmh, "km/h") if limit_kmh is not None else None
    return SpeedAssistance(tick=1, snapshot_stamp_ns=0, speed_mps=speed_kmh * KMH, limit=limit, warning=warning, **what)  # type: ignore[arg-type]


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
        (67, Warned(shown_s=1.1, sounded_s=6.1, sound_s=5.0), "not sounded after 3.0 to 5.0 s"),
        (67, Warned(shown_s=4.0, sounded_s=4.1, sound_s=5.0), "shown too late"),
        (67, Warned(shown_s=1.1, sounded_s=3.1, sound_s=9.0), "sounded for too long"),
        (54, Warned(shown_s=1.1, sounded_s=3.0, sound_s=5.0), "not sounded after 6.0 to 8.0 s"),
        (51, Warned(shown_s=1.1, sounded_s=9.0), "sounded, and no sound is due"),
        (51, Warned(), "passed"),
    ],
)
def test_the_verdict_on_a_warning_test(speed_kmh: int, found: Warned, says: str) -> None:
    assert verdict(WarningTest(speed_kmh), found) == says


@pytest.mark.parametrize(
    ("accelerates_mps2", "due_s"),
    [
        # 50 km/h is passed at 0 s. At 1 m/s²: 52.5 at 0.7 s + 6, 55 at 1.4 + 5, 60 at 2.8 + 4, 65 at 4.2 + 3
        (1.0, 6.4),
        # at 0.5: 1.4 + 6, 2.8 + 5, 5.6 + 4, 8.3 + 3
        (0.5, 7.4),
        # at 2: 0.35 + 6, 0.7 + 5, 1.4 + 4, 2.1 + 3
        (2.0, 5.1),
        (0.0, None),
    ],
)
def test_in_acceleration_the_sound_is_due_by_the_band_whose_time_is_over_first(
    accelerates_mps2: float, due_s: float | None
) -> None:
    course = [Moment(at / 100, 50 * KMH + 0.001 + accelerates_mps2 * at / 100, 50 * KMH) for at in range(1500)]
    found = warned(course, [(2.0, assisted("shown")), (5.0, assisted("sounded"))])
    assert found.due_s == pytest.approx(due_s, abs=0.05)
    assert (found.shown_s, found.sounded_s) == (2.0, 5.0)
    if due_s is not None:
        on_time = Warned(shown_s=1.2, sounded_s=due_s, sound_s=5.0, due_s=due_s)
        assert verdict(WarningTest(40, accelerates_mps2), on_time) == "passed"
        early = msgspec.structs.replace(on_time, sounded_s=due_s - 0.5)
        assert "not sounded" in verdict(WarningTest(40, accelerates_mps2), early)


def test_an_overspeed_ends_where_the_limit_is_kept_or_another_begins() -> None:
    speeds = [60] * 5 + [40] * 5 + [60] * 5
    limits = [50] * 12 + [55] * 3
    course = [Moment(float(at), v * KMH, limit * KMH) for at, (v, limit) in enumerate(zip(speeds, limits, strict=True))]
    assert [(each[0].time_s, each[-1].time_s) for each in overspeeds(course)] == [
        (0.0, 4.0),
        (10.0, 11.0),
        (12.0, 14.0),
    ]


@given(st.sampled_from(warnings.TESTS))
def test_a_warning_test_is_known_by_its_name_and_passes_the_sign_at_its_speed(test: WarningTest) -> None:
    assert warnings.test_of(test.name) == test
    plan = warnings.scenario(test)
    start, room_m = plan.ego.speed_kmh * KMH, warnings.SIGN_M - plan.ego.at_m
    at_sign = (start**2 + 2 * plan.ego.absent_mps2 * room_m) ** 0.5
    assert at_sign == pytest.approx(test.speed_kmh * KMH)


@pytest.mark.parametrize("test", [WarningTest(67), WarningTest(warnings.AT_SIGN_KMH, 1.0)])
def test_an_overspeed_is_sounded_in_time_through_the_whole_stack(tmp_path: Path, test: WarningTest) -> None:
    found = run_one(str(tmp_path), "k", _warning(test, "model"))
    assert verdict(test, found.warned) == "passed"
    assert msgspec.json.decode((tmp_path / "k.json").read_bytes(), type=Outcome) == found


def test_the_table_has_a_row_for_everything_and_a_dash_for_what_is_not_measured() -> None:
    nothing = Outcome(accuracy=Accuracy(), metrics=Metrics(), warned=Warned())
    for found in ({}, {"urb-rain/test/0": nothing}, {f"isa/warning/{warnings.TESTS[0].name}": nothing}):
        table = {what: value for what, value, _ in rows(*parts(found))}
        assert all(table.values())
    assert table["warning tests passed, at constant speed"] == "1 of 1"
    assert table["messages an hour"] == "-"


def test_special_limits_are_understood_where_all_their_drives_are() -> None:
    every = dict.fromkeys(DRIVES, True)
    assert all(capabilities(every).values())
    without_dry = capabilities({**every, "dry": False})
    assert [name for name, passed in without_dry.items() if not passed] == [RAIN]
    assert not any(capabilities({}).values())


@pytest.mark.parametrize("name", DRIVES)
def test_a_drive_past_a_special_limit_has_the_law_that_its_post_makes(name: str) -> None:
    law = build_law(scenario(name))
    wet = DRIVES[name].rain_mm_h > 0.0
    panels = {0: DRIVES[name].led}
    kmh = [limit and round(limit * 3.6) for limit in (law.at(at_m, panels).limit_mps(wet) for at_m in (130.0, 150.0))]
    assert kmh == {
        "wet": [100, 70], "dry": [100, 100], "arrow": [100, 100], "lorries": [100, 100], "town": [100, 50], "town-exit": [50, 100],
        "motorway": [100, None], "zone": [50, 30], "gantry": [None, 80], "gantry-lanes": [None, 80],
    }[name]  # fmt: skip


def test_a_limit_is_understood_that_is_right_from_two_seconds_behind_its_post_on() -> None:
    # the post is passed at 12.0 s
    def shown(before: int, kept: int) -> Record:
        return run([100] * 12 + [70] * 8, [100] * before + [70] * kept + [50] * (20 - before - kept))

    right, late, lost = shown(14, 6), shown(15, 5), shown(13, 5)
    assert (understood(right), understood(late), understood(lost)) == (True, False, False)
    assert not understood(run([100] * 5, [100] * 5))


def test_the_whole_stack_understands_a_plate_about_rain(tmp_path: Path) -> None:
    assert run_one(str(tmp_path), "k", _past("wet", "model")).understood


def test_the_guard_has_no_first_place(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "guard", "--from", "3"])
    assert "--from" in capsys.readouterr().err


def test_words_take_their_time() -> None:
    assert words_s("") == 0.0
    assert words_s("Deep water: ease off, don't brake") == pytest.approx(6 / 2.6)
    assert words_s("Great Britain: keep left, 20 miles an hour") == pytest.approx(8 / 2.6)
