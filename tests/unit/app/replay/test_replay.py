"""Deciding again from a log."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from app.replay.again import decide_again, traces
from app.replay.whatif import Change, otherwise
from drivemcp.cli import make_parser
from drivemcp.errors import UserError
from drivemcp.paths import data
from proto.decision import TraceRecord
from proto.health import ChainHead
from services.arbiter.profiles import profile
from services.logger.memory import MemoryStore
from services.logger.verification.verifier import verify
from services.rules.book import load_book
from tests.unit.app.replay.drive import drive, write_log

replace = msgspec.structs.replace


@pytest.fixture(scope="module")
def recorded() -> list[TraceRecord]:
    """130 ticks in which something is said, read, and nearly hit."""
    return drive(130)


@pytest.fixture(scope="module")
def log(recorded: list[TraceRecord], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drive")
    write_log(folder / "drive.mcap", recorded, folder / "secrets")
    return folder / "drive.mcap"


def _run(*arguments: str) -> int:
    flags = make_parser().parse_args(["replay", *arguments])
    status: int = flags.run(flags)
    return status


def test_the_drive_says_and_asks_something(recorded: list[TraceRecord]) -> None:
    assert {trace.decision.kind for trace in recorded} == {"SILENT", "SPEAK"}
    assert any(call.tool == "applicable_limit" for trace in recorded for call in trace.calls)


def test_every_tick_of_a_log_is_decided_again_the_same(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(str(log)) == 0
    assert capsys.readouterr().out == "130 ticks, 130 identical decisions, 0 different\n"


@pytest.fixture(scope="module")
def own_profile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped profile with another constant, as a calibration writes one."""
    path = tmp_path_factory.mktemp("profile") / "mine.toml"
    shipped = (profile.FOLDER / "calibrated.toml").read_text(encoding="utf-8")
    path.write_text(shipped + "\n# fitted elsewhere\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def own_log(own_profile: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("own")
    write_log(folder / "drive.mcap", drive(40, profile.load(own_profile)), folder / "secrets")
    return folder / "drive.mcap"


def test_a_log_made_with_a_profile_of_ones_own_is_decided_again_with_its_file(
    own_log: Path, own_profile: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(str(own_log), "--profile", str(own_profile)) == 0
    assert capsys.readouterr().out == "40 ticks, 40 identical decisions, 0 different\n"
    assert _run(str(own_log), "--profile", str(own_profile), "--delta", "0.6") == 0


def test_without_that_file_nothing_is_claimed_and_it_is_asked_for(
    own_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(str(own_log)) == 1
    assert "--profile FILE" in capsys.readouterr().out
    with pytest.raises(UserError, match="--profile FILE"):
        _run(str(own_log), "--delta", "0.6")


def test_a_file_that_is_no_profile_is_named(log: Path, tmp_path: Path) -> None:
    (tmp_path / "none.toml").write_text("name = 'none'\n")
    with pytest.raises(UserError, match=r"none\.toml"):
        _run(str(log), "--profile", str(tmp_path / "none.toml"))


def _other_target(trace: TraceRecord) -> TraceRecord:
    return replace(trace, fused=replace(trace.fused, target_mps=99.0))


def _other_kind(trace: TraceRecord) -> TraceRecord:
    return replace(trace, decision=replace(trace.decision, kind="ACT"))


def _other_number(trace: TraceRecord) -> TraceRecord:
    metrics = trace.decision.metrics
    return replace(trace, decision=replace(trace.decision, metrics=replace(metrics, r=metrics.r + 1e-16)))


def _other_input(trace: TraceRecord) -> TraceRecord:
    return replace(trace, inputs={**trace.inputs, "now_ns": trace.inputs["now_ns"] + 1})


def _other_answer(trace: TraceRecord) -> TraceRecord:
    return replace(trace, calls=(*trace.calls[:-1], replace(trace.calls[-1], status="timeout", result=None)))


@pytest.mark.parametrize("change", [_other_target, _other_kind, _other_number, _other_input])
def test_one_changed_number_in_one_tick_is_a_different_decision(
    recorded: list[TraceRecord], change: Callable[[TraceRecord], TraceRecord]
) -> None:
    statuses = [one.status for one in decide_again([*recorded[:50], change(recorded[50]), *recorded[51:60]])]
    assert statuses[:50] == ["identical"] * 50
    assert statuses[50] == "different"


def test_an_answer_that_came_otherwise_is_a_different_decision(recorded: list[TraceRecord]) -> None:
    i = next(i for i, trace in enumerate(recorded) if trace.calls and trace.calls[-1].ok)
    statuses = [one.status for one in decide_again([*recorded[:i], _other_answer(recorded[i])])]
    assert statuses == ["identical"] * i + ["different"]


def test_ticks_behind_a_gap_are_not_called_identical(recorded: list[TraceRecord]) -> None:
    ticks = list(decide_again([*recorded[:20], *recorded[21:]]))
    assert [one.status for one in ticks[:20]] == ["identical"] * 20
    known_again = next(i for i, trace in enumerate(recorded) if i > 20 and trace.state is not None)
    behind = ticks[20:known_again]
    assert {one.status for one in behind} == {"undecidable"}
    assert all("state before it" in one.why for one in behind)
    assert {one.status for one in ticks[known_again:]} == {"identical"}


def test_a_log_that_was_tampered_with_does_not_pass(log: Path, tmp_path: Path) -> None:
    raw = bytearray(log.read_bytes())
    raw[-200] ^= 1
    (tmp_path / "t.mcap").write_bytes(raw)
    assert _run(str(tmp_path / "t.mcap")) == 1
    assert _run("--delta", "0.0", str(tmp_path / "t.mcap")) == 1, "nor does what is supposed of it"


def test_a_log_that_lacks_the_head_that_memory_knows_does_not_pass(
    recorded: list[TraceRecord], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "logs" / "log.mcap"
    log.parent.mkdir()
    write_log(log, recorded, tmp_path / "secrets")
    assert _run(str(log)) == 0
    memory = MemoryStore(tmp_path / "memory.sqlite")
    memory.add_head(ChainHead(file=log.name, records=10_000, head_sha256="f" * 64), 3)
    memory.close()
    assert verify(log).intact, "the file alone does not tell a cut from a crash"
    assert _run(str(log)) == 1
    assert "it lacks the head that memory knows" in capsys.readouterr().err


def test_a_drive_of_which_a_file_is_missing_does_not_pass(
    recorded: list[TraceRecord], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    write_log(logs / "1.mcap", recorded[:40], tmp_path / "secrets")
    assert _run(str(tmp_path)) == 0
    memory = MemoryStore(tmp_path / "memory.sqlite")
    memory.add_head(ChainHead(file="0.mcap", records=1, head_sha256="0" * 64), 1)
    memory.close()
    assert _run(str(tmp_path)) == 1
    assert "0.mcap is gone" in capsys.readouterr().err
    write_log(logs / "2.mcap", recorded[40:], tmp_path / "secrets")
    assert _run(str(logs / "1.mcap"), str(logs / "2.mcap")) == 1
    assert "does not go on from" in capsys.readouterr().err


def test_other_packs_give_other_advice(log: Path) -> None:
    book, _ = load_book([data("rulepacks/GBR-v1")])
    ticks = list(otherwise(traces([log]), Change(book=book)))
    fields = {d.field for one in ticks for d in one.differences}
    assert {"directive", "kind"} <= fields, "the limit is a sign's, and an assumed one is not shown at first"


def test_the_same_pack_gives_the_same_drive(log: Path) -> None:
    book, _ = load_book([data("rulepacks/DEU-v1"), data("rulepacks/GBR-v1")])
    assert not any(one.differences for one in otherwise(traces([log]), Change(book=book)))


def test_a_lower_delta_never_leads_to_fewer_wishes_to_act(log: Path, recorded: list[TraceRecord]) -> None:
    def wishes(delta: float) -> int:
        wished = {trace.tick: trace.advisory.act_withheld != "" for trace in recorded}
        for one in otherwise(traces([log]), Change(delta=delta)):
            for difference in one.differences:
                if difference.field == "act_withheld":
                    wished[one.tick] = difference.again != '""'
        return sum(wished.values())

    counts = [wishes(delta) for delta in (0.4, 0.2, 0.0)]
    assert counts == sorted(counts)
    assert counts[-1] > counts[0]


def test_less_friction_never_lowers_the_risk(log: Path) -> None:
    for one in otherwise(traces([log]), Change(mu=0.1)):
        for difference in one.differences:
            if difference.field == "r":
                assert float(difference.again) >= float(difference.logged)


def test_suppositions_are_told_in_words(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run("--delta", "0.0", str(log)) == 0
    assert "would have differed: act_withheld in" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [
        ("none.mcap",),
        ("--mu", "-1", "LOG"),
        ("--delta", "9", "LOG"),
        ("--rulepack", "no-such", "LOG"),
        ("--mu", "0.5", "--against", "LOG", "LOG"),
        ("--delta", "0.1", "--against", "LOG", "LOG"),
        ("--rulepack", "DEU-v1", "--against", "LOG", "LOG"),
        ("--profile", "services/arbiter/profiles/paper.toml", "--against", "LOG", "LOG"),
    ],
)
def test_mistakes_are_told_in_one_line(log: Path, arguments: tuple[str, ...]) -> None:
    with pytest.raises(UserError) as told:
        _run(*(str(log) if argument == "LOG" else argument for argument in arguments))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("supposed", [(), ("--mu", "0.5"), ("--delta", "0.1")])
def test_a_state_that_does_not_fit_is_told_with_its_tick(
    recorded: list[TraceRecord], tmp_path: Path, supposed: tuple[str, ...]
) -> None:
    unfit = replace(recorded[0], tick=7, state={"tick": "seven"})
    write_log(tmp_path / "t.mcap", [unfit], tmp_path / "secrets")
    with pytest.raises(UserError, match="state of tick 7 does not fit"):
        _run(*supposed, str(tmp_path / "t.mcap"))


@pytest.mark.parametrize("supposed", [("--mu", "0.5"), ("--delta", "0.1"), ("--rulepack", "DEU-v1")])
def test_inputs_that_do_not_fit_are_told_with_their_tick(
    recorded: list[TraceRecord], tmp_path: Path, supposed: tuple[str, ...]
) -> None:
    unfit = replace(recorded[1], inputs={"now_ns": "late"})
    write_log(tmp_path / "t.mcap", [recorded[0], unfit], tmp_path / "secrets")
    with pytest.raises(UserError, match="tick 2 do not fit"):
        _run(*supposed, str(tmp_path / "t.mcap"))


def test_a_log_without_traces_is_a_mistake(tmp_path: Path) -> None:
    write_log(tmp_path / "empty.mcap", [], tmp_path / "secrets")
    with pytest.raises(UserError, match="no traces"):
        _run(str(tmp_path / "empty.mcap"))


def test_a_drive_is_the_same_as_itself_and_not_as_a_shorter_or_another_one(
    log: Path, recorded: list[TraceRecord], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run("--against", str(log), str(log)) == 0
    write_log(tmp_path / "short.mcap", recorded[:-1], tmp_path / "secrets")
    assert _run("--against", str(tmp_path / "short.mcap"), str(log)) == 1
    capsys.readouterr()
    write_log(tmp_path / "other.mcap", [*recorded[:-1], _other_number(recorded[-1])], tmp_path / "secrets")
    assert _run("--against", str(tmp_path / "other.mcap"), str(log)) == 1
    assert "tick 130: decision.metrics.r" in capsys.readouterr().out
