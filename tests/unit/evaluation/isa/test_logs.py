"""What logs tell of speed assistance, with and without truth."""

import shutil
from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.cli import run
from evaluation.isa.logs import overs, sign_delays_s
from evaluation.metrics import Recorder, keep
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec
from proto.scene import Fact
from proto.speed_assistance import SpeedAssistance
from proto.vehicle import Ego
from tests.unit.evaluation.isa.test_isa import assisted


def sign(**what: Any) -> Fact:
    plain: dict[str, Any] = {
        "kind": "limit",
        "unit": "km/h",
        "passed": True,
        "confidence": 1.0,
        "frame_stamp_ns": 0,
        "track_id": 1,
    }
    return Fact(**{**plain, "reading": "limit:50", "value": 50.0, **what})


def display(*shown: tuple[float, float | None]) -> list[tuple[float, SpeedAssistance]]:
    return [(at_s, assisted(limit_kmh=limit)) for at_s, limit in shown]


@pytest.mark.parametrize(
    ("shown", "delay_s"),
    [
        (display((1.0, 70.0), (9.0, 50.0), (11.0, 50.0)), 0.0),
        (display((1.0, 70.0), (10.5, 70.0), (11.5, 50.0)), 1.5),
        (display((1.0, 70.0), (25.0, 50.0)), None),
        (display((1.0, None), (10.5, None)), None),
        ([], None),
    ],
)
def test_the_delay_after_a_sign_is_until_its_number_is_shown(
    shown: list[tuple[float, SpeedAssistance]], delay_s: float | None
) -> None:
    assert list(sign_delays_s([(10.0, sign())], shown)) == [delay_s]


def test_twin_signs_count_once_and_what_is_no_passed_limit_not_at_all() -> None:
    others = [sign(passed=False), sign(believed=False), sign(kind="sign"), sign(value=None)]
    facts = [(10.0, sign()), (10.1, sign()), (20.0, sign()), *((30.0, each) for each in others)]
    assert len(list(sign_delays_s(facts, display((1.0, 50.0))))) == 2


def course(kmh: float, sounded_at_s: float | None, **what: Any) -> list[tuple[float, SpeedAssistance]]:
    """From 1.0 s on at that speed in a 50, for 20 s; shown after 1 s, sounded from an instant on for 5 s."""

    def warning(at_s: float) -> str:
        if sounded_at_s is not None and sounded_at_s <= at_s < sounded_at_s + 5.0:
            return "sounded"
        return "shown" if at_s >= 2.0 else "none"

    return [(at / 10, assisted(warning(at / 10), speed_kmh=kmh if at >= 10 else 40.0, **what)) for at in range(200)]


@pytest.mark.parametrize(
    ("shown", "pedal", "says"),
    [
        (course(67.0, 4.0), 0.2, "passed"),
        (course(67.0, None), 0.2, "not sounded after 3.0 s"),
        (course(67.0, 9.0), 0.2, "not sounded after 3.0 s"),
        (course(67.0, None), 0.0, "the driver had answered"),
        (course(67.0, None, muted=True), 0.2, "muted"),
        (course(52.0, None), 0.2, "passed"),
    ],
)
def test_an_overspeed_of_the_limit_shown_is_judged_by_the_table(
    shown: list[tuple[float, SpeedAssistance]], pedal: float, says: str
) -> None:
    (found,) = overs(shown, [(at / 10, Ego(accelerator_pedal=pedal)) for at in range(200)])
    assert found.verdict == says
    assert (found.at_s, found.limit_kmh) == pytest.approx((1.0, 50.0))


def test_an_assumed_limit_has_no_overspeed() -> None:
    shown = course(67.0, None)
    guessed = [
        (at_s, msgspec.structs.replace(each, limit=msgspec.structs.replace(each.limit, assumed=True)))
        for at_s, each in shown
        if each.limit is not None
    ]
    assert list(overs(guessed, [])) == []


def test_a_log_tells_with_truth_and_without_and_says_what_it_cannot(tmp_path: Path) -> None:
    recorder = Recorder()
    drive(RunSpec(scenario="urb-rain/test/0", seconds=6.0, sensors="model"), tmp_path, recorder.follow)
    (log,) = (tmp_path / "logs").glob("*.mcap")
    (bare := tmp_path / "bare").mkdir()
    shutil.copy(log, bare / "log.mcap")
    keep(recorder, log.parent)
    assert run(["evaluate", "isa", "--log", str(log), "--log", str(bare / "log.mcap"), "--out", str(tmp_path)]) == 0
    page = (tmp_path / "isa-logs" / "logs.md").read_text(encoding="utf-8")
    assert "right limit shown, by distance, all" in page
    assert f"Without truth are: {bare / 'log.mcap'}" in page
    assert run(["evaluate", "isa", "--log", str(bare / "log.mcap"), "--out", str(tmp_path)]) == 0
    page = (tmp_path / "isa-logs" / "logs.md").read_text(encoding="utf-8")
    assert "right limit shown" not in page
    assert "false warnings per" not in page
    assert "messages an hour" in page


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (("guard", "--log", "x.mcap"), "--log: the table guard is driven"),
        (("isa", "--log", "x.mcap", "--runs", "2"), "--log: a log was driven before"),
        (("isa", "--log", "/nosuch/x.mcap"), "/nosuch/x.mcap: No such file or directory"),
    ],
)
def test_what_is_asked_wrongly_of_logs_is_named(
    asked: tuple[str, ...], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["evaluate", *asked, "--out", str(tmp_path)]) == 2
    assert says in capsys.readouterr().err
