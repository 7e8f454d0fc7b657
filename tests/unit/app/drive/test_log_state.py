"""What the end of a drive says of its log."""

from pathlib import Path

import pytest

from app.drive.log_state import state_of
from app.drive.summary import Tally
from app.drive.words import summary_lines
from services.logger.format import signing
from services.logger.writing.topic_formats import Gap, gap_record
from tests.unit.services.logger.conftest import FLUSHES, write

FULL = "the log cannot be written: No space left on device"


def test_a_log_that_verifies_lacks_nothing_and_was_closed_is_whole(closed_log: Path) -> None:
    assert state_of([closed_log], {"log_lost": "0", "log_trouble": ""}).whole


def test_without_a_log_the_reason_that_the_logger_gave_is_told() -> None:
    state = state_of([], {"log_trouble": FULL})
    assert not state.whole
    assert state.verified is None
    assert state.trouble == FULL


@pytest.mark.parametrize("detail", [{}, {"log_lost": "7"}, {"log_lost": "many"}])
def test_lost_records_are_counted_from_the_log_itself_with_their_reason(
    tmp_path: Path, signer: signing.Signer, detail: dict[str, str]
) -> None:
    gap = gap_record(Gap(lost=7, from_ns=1, until_ns=2, reason=FULL), sequence=1)
    write(tmp_path / "t.mcap", signer, flushes=[*FLUSHES, [gap]])
    state = state_of([tmp_path / "t.mcap"], detail)
    assert (state.verified, state.lost, state.whole) == (True, 7, False)
    assert state.trouble == f"7 messages are missing from it: {FULL}"


def test_lost_records_that_no_disk_took_are_counted_from_the_loggers_health(closed_log: Path) -> None:
    state = state_of([closed_log], {"log_lost": "12", "log_trouble": FULL})
    assert (state.lost, state.whole) == (12, False)
    assert FULL in state.trouble


def test_records_that_waited_for_a_full_disk_to_the_end_are_lost(tmp_path: Path, signer: signing.Signer) -> None:
    detail = {"log_lost": "2", "log_waiting": "40", "log_trouble": FULL}
    write(tmp_path / "closed.mcap", signer)
    assert state_of([tmp_path / "closed.mcap"], detail).lost == 2
    write(tmp_path / "open.mcap", signer, close=False)
    state = state_of([tmp_path / "open.mcap"], detail)
    assert (state.lost, state.whole) == (42, False)
    assert state.trouble.startswith(f"42 messages are missing from it: {FULL}")


def test_a_log_whose_writer_stopped_is_not_whole_and_says_why(tmp_path: Path, signer: signing.Signer) -> None:
    write(tmp_path / "t.mcap", signer, close=False)
    state = state_of([tmp_path / "t.mcap"], {"log_trouble": "the writer has stopped"})
    assert (state.verified, state.whole) == (True, False)
    assert state.trouble == "its last file was not closed: the writer has stopped"


def test_a_logger_that_was_killed_and_went_on_in_another_file_leaves_a_whole_log(
    tmp_path: Path, signer: signing.Signer
) -> None:
    head = write(tmp_path / "1.mcap", signer, close=False).head.head_sha256
    write(tmp_path / "2.mcap", signer, previous_head=head)
    assert state_of([tmp_path / "1.mcap", tmp_path / "2.mcap"], {}).whole


def test_the_summary_says_that_a_log_is_not_whole() -> None:
    said = summary_lines(Tally().summary(log="t.mcap", verified=True, lost=3, trouble="3 messages are missing from it"))
    assert said[-1].split(maxsplit=4) == ["log", "is", "not", "whole", "3 messages are missing from it"]
