"""Nothing that a tool, a sign or a log says moves a terminal's cursor or turns its text around."""

import io
import json
import sys
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.drive.screen import Screen
from drivemcp.cli import main
from drivemcp.terminal import Printable, printable

HOSTILE = "\x1b]0;title\x07\x1b[2Jgone\r\x9b31mred\u202etxet\x7f"


@given(st.text())
def test_no_control_or_direction_character_is_left_but_tab_and_line_feed(text: str) -> None:
    found = {one for one in printable(text) if unicodedata.category(one) in ("Cc", "Cs")} - {"\n", "\t"}
    assert found == set()
    assert not set(printable(text)) & set("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
    assert printable(printable(text)) == printable(text)


@given(st.text(st.characters(exclude_categories=("Cc", "Cf", "Cs"))))
def test_other_text_stays_as_it_is(text: str) -> None:
    assert printable(text) == text


@given(st.dictionaries(st.text(), st.text() | st.integers() | st.none()))
def test_json_says_the_same_after_it(value: dict[str, str | int | None]) -> None:
    assert json.loads(printable(json.dumps(value, ensure_ascii=False))) == value


def test_a_command_writes_hostile_names_harmlessly(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdout", sys.stdout)
    monkeypatch.setattr(sys, "stderr", sys.stderr)
    with pytest.raises(SystemExit):
        main(["audit", "verify", HOSTILE])
    said = capsys.readouterr().err
    assert "no such file" in said
    assert "\\u001b]0;title\\u0007" in said
    assert not set("\x1b\x07\r\x9b\u202e\x7f") & set(said)


def test_what_is_spoken_cannot_redraw_the_screen() -> None:
    written = io.StringIO()
    screen = Screen(written.write)
    screen.say(HOSTILE)
    screen.live(HOSTILE + "\nsecond line")
    assert not set("\x1b\x07\r\x9b\u202e\x7f") & set(written.getvalue())
    assert len(written.getvalue().splitlines()) == 2


def test_the_stream_is_still_the_stream() -> None:
    below = io.StringIO()
    stream = Printable(below)
    assert stream.write("a\x1b") == 2
    assert not stream.isatty()
    assert below.getvalue() == "a\\u001b"
