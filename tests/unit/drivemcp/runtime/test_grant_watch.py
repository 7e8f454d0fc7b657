"""A grant under watch: whatever is done to files, clocks and processes, what has ended stays ended."""

import tempfile
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.runtime.grant_watch import Floor, ForwardTime, TrustedKeys, WatchedGrant
from drivemcp.runtime.grants import make_key, sign_grant
from proto.decision import Grant

KEY = make_key()
START = datetime(2030, 1, 1, 12, tzinfo=UTC)
HOUR = 3600.0


def signed(sequence: int, issued_s: float = 0.0, hours: float = 1.0) -> bytes:
    grant = Grant(
        grant_id=f"g-{sequence}",
        vehicle="ego",
        capability="actuation/brake",
        max_deceleration_mps2=4.0,
        max_duration_s=2.0,
        issued_at=(START + timedelta(seconds=issued_s)).isoformat(),
        expires_at=(START + timedelta(seconds=issued_s, hours=hours)).isoformat(),
        sequence=sequence,
    )
    return msgspec.json.encode(sign_grant(grant, KEY.private))


class Watched:
    """A grant in a folder, two clocks that a test moves, and a process that may start again."""

    def __init__(self, folder: Path) -> None:
        self.file, self.keys = folder / "grant.json", folder / "keys"
        self.keys.write_text(KEY.public + "\n")
        self._memory = folder / "ended.json"
        self.steady_s = 0.0
        self.offset_s = 0.0
        self.restart()

    def restart(self) -> None:
        self._floor = Floor(self._memory)
        self._grant = WatchedGrant(
            self.file,
            keys=TrustedKeys(file=str(self.keys)),
            vehicle="ego",
            capability="actuation/brake",
            floor=self._floor,
            clock=ForwardTime(self._wall, lambda: int(self.steady_s * 1e9), self._floor.latest),
        )

    def _wall(self) -> datetime:
        return START + timedelta(seconds=self.steady_s + self.offset_s)

    def counts(self) -> str:
        """The id of the grant that counts; empty: none does."""
        grant, refused = self._grant.current()
        assert (grant is None) == bool(refused)
        self._grant.keep()
        return grant.grant_id if grant is not None else ""


@pytest.fixture
def watched(tmp_path: Path) -> Watched:
    return Watched(tmp_path)


def test_a_grant_counts_until_its_file_is_gone_and_never_again(watched: Watched) -> None:
    watched.file.write_bytes(signed(1))
    assert watched.counts() == "g-1"
    watched.file.unlink()
    assert watched.counts() == ""
    watched.file.write_bytes(signed(1))
    assert watched.counts() == ""
    watched.restart()
    assert watched.counts() == ""
    watched.file.write_bytes(signed(2))
    assert watched.counts() == "g-2"


def test_a_key_that_leaves_its_file_ends_the_grant(watched: Watched) -> None:
    watched.file.write_bytes(signed(1))
    assert watched.counts() == "g-1"
    watched.keys.write_text(f"# {KEY.public}\n")
    assert watched.counts() == ""
    watched.keys.write_text(KEY.public)
    assert watched.counts() == ""


@pytest.mark.parametrize("restarted", [False, True])
def test_an_expiry_does_not_come_back_when_the_clock_is_set_back(watched: Watched, restarted: bool) -> None:
    watched.file.write_bytes(signed(1))
    assert watched.counts() == "g-1"
    watched.steady_s = HOUR
    assert watched.counts() == ""
    watched.offset_s = -HOUR
    if restarted:
        watched.restart()
    assert watched.counts() == ""


def test_a_clock_that_is_set_back_before_the_expiry_lengthens_nothing(watched: Watched) -> None:
    watched.file.write_bytes(signed(1))
    assert watched.counts() == "g-1"
    watched.offset_s, watched.steady_s = -HOUR / 2, HOUR - 1.0
    assert watched.counts() == "g-1"
    watched.steady_s = HOUR
    assert watched.counts() == ""


def test_a_restart_behind_a_clock_that_was_set_back_lengthens_nothing(watched: Watched) -> None:
    watched.file.write_bytes(signed(1))
    watched.steady_s = 3000.0
    assert watched.counts() == "g-1"
    watched.offset_s = -2000.0
    watched.restart()
    assert watched.counts() == "g-1"
    watched.steady_s = HOUR
    assert watched.counts() == ""


def test_an_earlier_grant_does_not_take_the_place_of_a_later_one(watched: Watched) -> None:
    watched.file.write_bytes(signed(5))
    assert watched.counts() == "g-5"
    watched.file.write_bytes(signed(4))
    assert watched.counts() == ""
    watched.file.write_bytes(signed(6))
    assert watched.counts() == "g-6"


@pytest.mark.parametrize("text", [b"", b"[]", b'{"a": "b"}', b"\xff\xfe"])
def test_a_memory_of_ended_grants_that_cannot_be_read_lets_none_count(tmp_path: Path, text: bytes) -> None:
    (tmp_path / "ended.json").write_bytes(text)
    watched = Watched(tmp_path)
    watched.file.write_bytes(signed(1))
    assert watched.counts() == ""


def test_a_memory_that_cannot_be_written_lets_none_count_after_the_first(tmp_path: Path) -> None:
    floor = Floor(tmp_path / "file" / "ended.json")
    (tmp_path / "file").write_text("no folder")
    grant = msgspec.json.decode(signed(1), type=Grant)
    assert floor.bars(grant) == ""
    floor.ended(grant, START)
    assert "cannot be kept" in floor.bars(msgspec.structs.replace(grant, sequence=9))


ACTIONS = st.one_of(
    st.tuples(st.just("put"), st.integers(0, 4)),
    st.tuples(st.sampled_from(["remove", "restart", "key gone", "key back"]), st.just(0)),
    st.tuples(st.just("wait"), st.integers(1, 7200)),
    st.tuples(st.just("step"), st.integers(-7200, 7200)),
)


@given(st.lists(ACTIONS, max_size=14))
def test_no_sequence_of_events_brings_back_what_has_ended(actions: Sequence[tuple[str, int]]) -> None:
    """A grant that counted and then did not never counts again; none counts for longer than it was signed for."""
    with tempfile.TemporaryDirectory() as folder:
        watched = Watched(Path(folder))
        ended, since_s, before = set[str](), dict[str, float](), ""
        for what, value in actions:
            if what == "put":
                watched.file.write_bytes(signed(value))
            elif what == "remove":
                watched.file.unlink(missing_ok=True)
            elif what == "restart":
                watched.restart()
            elif what == "key gone":
                watched.keys.write_text("")
            elif what == "key back":
                watched.keys.write_text(KEY.public)
            elif what == "wait":
                watched.steady_s += value
            else:
                watched.offset_s += value
            counts = watched.counts()
            if before and counts != before:
                ended.add(before)
            assert counts not in ended, what
            if counts:
                assert watched.steady_s - since_s.setdefault(counts, watched.steady_s) < HOUR
                assert int(counts[2:]) >= max((int(one[2:]) for one in since_s), default=0), "a later one was there"
            before = counts
