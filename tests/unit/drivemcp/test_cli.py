"""The console command as a shell sees it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from drivemcp.cli import run


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["run", "nonsense"], "nonsense"),
        (["up", "--scenario", "nowhere"], "nowhere"),
        (["up", "--scenario", "absent.toml"], "absent.toml"),
        (["play", "absent.mp4"], "absent.mp4"),
        (["audit", "verify", "absent.mcap"], "absent.mcap"),
        (["replay", "absent.mcap"], "absent.mcap"),
        (["tools", "call", "x", "{not json"], "JSON"),
        (["tools", "new", "Not A Name"], "Not A Name"),
        (["tools", "list", "--connect", "tcp/127.0.0.1:1"], "tcp/127.0.0.1:1"),
        (["grant", "--vehicle", "x"], "--key"),
        (["run", "can", "--config", "absent.toml"], "absent.toml"),
        (["run", "can", "--set", "no_such_key=1"], "no_such_key"),
        (["run", "can", "--vehicle", "a/b"], "vehicle"),
        (["tools", "list", "--connect", "tcp/127.0.0.1:1", "--vehicle", "a/b"], "--vehicle"),
    ],
)
def test_a_users_mistake_is_told_in_one_line_without_a_traceback(
    arguments: list[str], word: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    error = capsys.readouterr().err
    assert word in error
    assert "Traceback" not in error
    assert ".rs:" not in error
    assert len([line for line in error.splitlines() if line.startswith("drivemcp")]) == 1


def test_ask_without_a_running_stack_says_how_to_start_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert run(["ask", "Are we in mph now?"]) == 2
    assert "drivemcp up" in capsys.readouterr().err


def test_help_names_every_command() -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "drivemcp.cli", "--help"], capture_output=True, text=True, timeout=60, check=True
    )
    for command in ("up", "run", "play", "tools", "ask", "audit", "replay", "view", "grant", "doctor", "mcp"):
        assert f"\n    {command} " in ran.stdout
    assert "not installed" not in ran.stdout


def test_no_command_waits_for_what_another_one_computes_with() -> None:
    code = "import sys; from drivemcp.cli import make_parser; make_parser(); print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert not {"numpy", "scipy", "matplotlib", "highway_env"} & set(ran.stdout.split())


def test_a_grant_is_signed_with_a_key_that_only_its_owner_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key, grant = tmp_path / "key", tmp_path / "grant.json"
    assert run(["grant", "--make-key", str(key)]) == 0
    public = capsys.readouterr().out.strip()
    assert os.stat(key).st_mode & 0o777 == 0o600
    assert run(["grant", "--key", str(key), "--vehicle", "car-1", "--out", str(grant)]) == 0
    from datetime import UTC, datetime

    from drivemcp.runtime.grants import GrantRefused, read_grant, verify_grant

    signed = read_grant(grant.read_bytes())
    verify_grant(signed, [public], vehicle="car-1", capability="actuation/brake", now=datetime.now(UTC))
    forged = json.loads(grant.read_text()) | {"max_deceleration_mps2": 9.0}
    with pytest.raises(GrantRefused, match="altered"):
        verify_grant(
            read_grant(json.dumps(forged).encode()), [public], vehicle="car-1", capability="actuation/brake",
            now=datetime.now(UTC),
        )  # fmt: skip
    assert run(["grant", "--make-key", str(key)]) == 2


def test_a_taken_port_is_told_in_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        from drivemcp.bus.router import main

        assert main(["--listen", f"tcp/127.0.0.1:{taken.getsockname()[1]}"]) == 2
    assert "port" in capfd.readouterr().err


def test_a_deadline_that_cannot_be_kept_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        run(["tools", "call", "x", "--deadline-ms", "20001"])
    assert "no number from 1 to 20000" in capsys.readouterr().err


@pytest.mark.parametrize("asked", [["models", "list"], ["rulepack", "show", "DEU-v1"]])
def test_nothing_is_said_where_nobody_reads_on(asked: list[str]) -> None:
    """Little that is printed, and more than fits into a pipe's buffer."""
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "drivemcp.cli", *asked]
    ran = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, timeout=60, check=False)
    os.close(writer)
    assert (ran.returncode, ran.stderr) == (0, b"")


def test_a_connection_that_breaks_is_no_reader_that_went_away(capsys: pytest.CaptureFixture[str]) -> None:
    def broken() -> None:
        raise BrokenPipeError(32, "Broken pipe")

    assert run(["models", "list"], broken) == 1
    assert "drivemcp: a connection broke off: " in capsys.readouterr().err
