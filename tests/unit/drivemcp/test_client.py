"""The note of the running stack: nobody else may write or read it."""

import os
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from drivemcp.client import RunningStack, forget_stack, note_stack, read_stack, state_file
from drivemcp.errors import UserError

STACK = RunningStack(endpoint="tcp/127.0.0.1:1", vehicle="car", folder="out", pid=os.getpid())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the note's folder would be made; its parent is open to all, as /tmp is."""
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return state_file().parent


def test_the_note_is_written_for_this_user_alone_read_and_forgotten(folder: Path) -> None:
    assert read_stack() is None
    note_stack(STACK)
    assert folder.stat().st_mode & 0o077 == 0
    assert read_stack() == STACK
    assert [path.name for path in folder.iterdir()] == ["stack.json"]
    forget_stack(os.getpid())
    assert read_stack() is None


def _open_to_all(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)


def _a_link(folder: Path) -> None:
    (folder.parent / "elsewhere").mkdir(mode=0o700)
    folder.symlink_to(folder.parent / "elsewhere")


def _a_file(folder: Path) -> None:
    folder.touch(mode=0o600)


@pytest.mark.parametrize("made", [_open_to_all, _a_link, _a_file])
def test_a_folder_that_another_could_have_made_is_neither_written_nor_read(
    folder: Path, made: Callable[[Path], None]
) -> None:
    made(folder)
    if folder.is_dir():
        forged = msgspec.structs.replace(STACK, endpoint="tcp/evil:1")
        (folder / "stack.json").write_bytes(msgspec.json.encode(forged))
    with pytest.raises(UserError, match=r"not yours alone|cannot note"):
        note_stack(STACK)
    with pytest.raises(UserError, match="not yours alone"):
        read_stack()
    forget_stack(os.getpid())
    assert not folder.is_dir() or "evil" in (folder / "stack.json").read_text()


def test_a_note_that_is_a_link_is_replaced_and_what_it_points_to_left_alone(folder: Path) -> None:
    folder.mkdir(mode=0o700)
    precious = folder.parent / "precious"
    precious.write_text("precious")
    (folder / "stack.json").symlink_to(precious)
    note_stack(STACK)
    assert precious.read_text() == "precious"
    assert read_stack() == STACK
