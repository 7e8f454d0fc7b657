"""A user's mistakes are told before anything starts."""

import argparse
import socket
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from app.drive.precheck import check_port, check_services, check_settings, check_voice, profile_of, vehicle_of
from drivemcp.cli import main
from drivemcp.errors import UserError
from drivemcp.runtime.grants import KeyPair, make_key, sign_grant
from proto import topics
from proto.decision import Grant


def grant_file(folder: Path, key: KeyPair, vehicle: str) -> str:
    now = datetime.now(UTC)
    grant = Grant(
        grant_id="g1", vehicle=vehicle, capability=topics.BRAKE.name, max_deceleration_mps2=3.0, max_duration_s=2.0,
        issued_at=now.isoformat(), expires_at=(now + timedelta(hours=1)).isoformat(),
    )  # fmt: skip
    path = folder / "grant.json"
    path.write_bytes(msgspec.json.encode(sign_grant(grant, key.private)))
    return str(path)


def flags(grant: str = "", trust: list[str] | None = None, vehicle: str = "") -> argparse.Namespace:
    return argparse.Namespace(grant=grant, trust=trust or [], vehicle=vehicle)


def status_of(line: list[str]) -> object:
    """How the command ends."""
    with pytest.raises(SystemExit) as ended:
        main(line)
    return ended.value.code


def test_a_grant_names_the_vehicle_where_nobody_else_does(tmp_path: Path) -> None:
    key = make_key()
    grant = grant_file(tmp_path, key, "ego")
    assert vehicle_of(flags(grant, [key.public])) == "ego"
    assert vehicle_of(flags(vehicle="car-1")) == "car-1"
    assert vehicle_of(flags()) == ""


def test_a_grant_that_would_not_count_is_refused_before_the_drive(tmp_path: Path) -> None:
    key, other = make_key(), make_key()
    grant = grant_file(tmp_path, key, "ego")
    with pytest.raises(UserError, match="no trusted key"):
        vehicle_of(flags(grant, [other.public]))
    with pytest.raises(UserError, match="is for actuation/brake of ego"):
        vehicle_of(flags(grant, [key.public], vehicle="van"))
    (tmp_path / "garbage").write_text("garbage")
    with pytest.raises(UserError, match="no grant"):
        vehicle_of(flags(str(tmp_path / "garbage"), [key.public]))
    with pytest.raises(UserError, match="--trust: this is no public key"):
        vehicle_of(flags(trust=["AAAA"]))


def test_names_and_ports_are_checked() -> None:
    with pytest.raises(UserError, match="--vehicle"):
        vehicle_of(flags(vehicle="a/b*"))
    with pytest.raises(UserError, match="no service 'nosuch'; there are arbiter"):
        check_services(["nosuch"], [], {})
    with pytest.raises(UserError, match="no service 'foo'"):
        check_services([], [], {"foo": {"bar": 1}})
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(UserError, match="port"):
        check_port(taken.getsockname()[1])
    check_port(0)


def test_a_voice_that_is_not_on_this_machine_is_named_with_what_to_type() -> None:
    with pytest.raises(UserError, match=r"no-such-voice.* is not on the path; apt-get install espeak-ng"):
        check_voice({"speech_command": "no-such-voice {text}"})
    check_voice({"speech_command": "sh -c {text}"})


def test_settings_are_those_that_the_service_would_take() -> None:
    check_settings({"arbiter": {"delta": 0.2, "profile": "paper"}, "simulator": {"seed": "3"}})
    with pytest.raises(UserError, match=r"--set simulator: Expected `int`, got `str`"):
        check_settings({"simulator": {"seed": "3"}}, strict=True)
    with pytest.raises(UserError, match=r"--set orchestrator: .*`nosuch`"):
        check_settings({"arbiter": {}, "orchestrator": {"nosuch": 1}})


def test_a_profile_is_one_that_is_shipped_or_a_file(tmp_path: Path) -> None:
    assert profile_of("--profile", "paper").name == "paper"
    with pytest.raises(
        UserError, match=r"--profile nosuch: No such file .*there are calibrated, paper, or name a file"
    ):
        profile_of("--profile", "nosuch")
    (tmp_path / "p.toml").write_text("name = 3")
    with pytest.raises(UserError, match=r"--profile: .*p\.toml: .*name"):
        profile_of("--profile", str(tmp_path / "p.toml"))


@pytest.mark.parametrize(
    "line",
    [
        ["up", "--seconds", "-5"],
        ["up", "--seconds", "nan"],
        ["up", "--port", "99999"],
        ["play", ".", "--fov", "400"],
        ["play", ".", "--period", "0"],
        ["grant", "--key", "k", "--valid", "1e12"],
        ["tools", "call", "x", "{}", "--deadline-ms", "nan"],
    ],
)
def test_numbers_out_of_their_range_are_refused(line: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of(line) == 2
    assert "is no" in capsys.readouterr().err


@pytest.mark.parametrize(
    "line",
    [
        ["up", "--vehicle", "a/b*"],
        ["up", "--set", "arbiter.nosuch=1"],
        ["up", "--set", "arbiter.profile=nosuch"],
        ["up", "--set", "arbiter.profile={tmp}/bad.toml"],
        ["up", "--with", "nosuch"],
        ["up", "--scenario", "{tmp}/bad.toml"],
        ["up", "--scenario", "{tmp}/bad.json"],
        ["play", "{tmp}", "--render", "{tmp}/nowhere/x.mp4"],
        ["grant", "--key", "{tmp}/bin.key"],
        ["grant", "--key", "{tmp}/short.key"],
        ["grant", "--key", "{tmp}/good.key", "--out", "{tmp}/nowhere/g"],
        ["grant", "--key", "{tmp}/good.key", "--capability", "bogus"],
        ["run", "can", "--config", "{tmp}/bin.key"],
        ["run", "can", "--set", "vehicle=a", "--set", "vehicle.b=1"],
        ["tools", "new", "class"],
        ["tools", "new", "x2", "--into", "{tmp}/bin.key"],
        ["calibrate", "--quick", "--out", "{tmp}/bin.key"],
    ],
)
def test_mistakes_are_one_line_and_status_2(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bin.key").write_bytes(b"\xff\xfe\x00key")
    (tmp_path / "short.key").write_text("AAAA")
    (tmp_path / "good.key").write_text(make_key().private)
    (tmp_path / "bad.toml").write_text("name = 3")
    (tmp_path / "bad.json").write_text('{"name": 3}')
    status = status_of([word.format(tmp=tmp_path) for word in line])
    told = capsys.readouterr().err
    assert status == 2, told
    assert len(told.strip().splitlines()) == 1, told
    assert not (tmp_path / "out").exists(), "nothing was started"


@pytest.mark.parametrize(("name", "text"), [("bad.toml", "name = 3"), ("bad.json", '{"name": 3}')])
def test_a_scenario_file_of_either_form_is_read_and_what_is_wrong_in_it_named(
    name: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(text)
    assert status_of(["up", "--scenario", name]) == 2
    told = capsys.readouterr().err
    assert "name" in told
    assert "str" in told, told
