"""Completion in a shell, asked as the shell asks."""

import shutil
import subprocess
from pathlib import Path

import pytest

from drivemcp.cli import run
from drivemcp.commands.completion import SHELLS

pytest.importorskip("shtab", reason="shtab is not installed (pip install 'drivemcp[completion]')")
BASH = shutil.which("bash")


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_gets_a_script_with_the_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["completion", shell]) == 0
    told = capsys.readouterr().out
    assert "rulepack" in told
    assert "replay" in told


@pytest.mark.skipif(BASH is None, reason="no bash on the path")
@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (["drivemcp", "rep"], {"replay", "report"}),
        (["drivemcp", "rulepack", "val"], {"validate"}),
        (["drivemcp", "up", "--scen"], {"--scenario"}),
        (["drivemcp", "completion", "z"], {"zsh"}),
    ],
)
def test_bash_completes_commands_flags_and_choices(
    words: list[str], completed: set[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(["completion", "bash"])
    (tmp_path / "script").write_text(capsys.readouterr().out)
    asked = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _shtab_drivemcp"
    answer = subprocess.run(
        [str(BASH), "-c", f'source {tmp_path / "script"}; {asked}; printf "%s\\n" "${{COMPREPLY[@]}}"'],
        capture_output=True, text=True, timeout=30.0, check=True,
    )  # fmt: skip
    assert set(answer.stdout.split()) == completed
