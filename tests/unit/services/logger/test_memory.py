"""Long-term memory."""

from pathlib import Path

import pytest

from proto.health import ChainHead
from services.logger.memory import MAX_VALUE_BYTES, MemoryStore, TraceQuery, TraceRow, kept_head


def _row(tick: int, decision: str = "SILENT", events: tuple[str, ...] = (), directive: str = "") -> TraceRow:
    return TraceRow(
        tick=tick,
        stamp_ns=tick * 100,
        cause="snapshot",
        decision=decision,
        events=events,
        urgency="info",
        topic="speed",
        directive=directive,
        target_mps=None,
        file="t.mcap",
    )


@pytest.fixture
def memory(tmp_path: Path) -> MemoryStore:
    return MemoryStore(tmp_path / "memory.sqlite")


def test_the_newest_of_a_key_comes_first_and_the_older_stay(memory: MemoryStore) -> None:
    memory.remember("preferences", "driver", {"unit": "km/h"}, stamp_ns=1)
    memory.remember("preferences", "driver", {"unit": "mph"}, stamp_ns=2)
    memory.remember("preferences", "guest", {"unit": "km/h"}, stamp_ns=3)
    assert [one.value["unit"] for one in memory.recall("preferences", "driver")] == ["mph", "km/h"]
    assert len(memory.recall("preferences")) == 3
    assert memory.recall("feedback") == ()


def test_memories_outlive_the_process(tmp_path: Path) -> None:
    first = MemoryStore(tmp_path / "memory.sqlite")
    first.remember("note", "k", {"a": [1, "ä"]}, stamp_ns=1)
    first.close()
    assert MemoryStore(tmp_path / "memory.sqlite").recall("note", "k")[0].value == {"a": [1, "ä"]}


def test_a_memory_that_is_too_large_is_refused(memory: MemoryStore) -> None:
    with pytest.raises(ValueError, match="at most"):
        memory.remember("note", "k", {"a": "x" * MAX_VALUE_BYTES}, stamp_ns=1)


@pytest.mark.parametrize(
    ("query", "ticks"),
    [
        (TraceQuery(), [3, 2, 1, 0]),
        (TraceQuery(limit=2), [3, 2]),
        (TraceQuery(event="overspeed"), [2, 1]),
        (TraceQuery(event="over"), []),
        (TraceQuery(decision="speak"), [2]),
        (TraceQuery(text="SLOW"), [2]),
        (TraceQuery(after_ns=100, before_ns=300), [2, 1]),
        (TraceQuery(event="' OR 1=1 --"), []),
    ],
)
def test_traces_are_found_by_event_decision_words_and_time(
    memory: MemoryStore, query: TraceQuery, ticks: list[int]
) -> None:
    memory.add_traces(
        [
            _row(0),
            _row(1, events=("overspeed", "stale_fact")),
            _row(2, "SPEAK", ("low_friction", "overspeed"), "Slow down"),
            _row(3),
        ]
    )
    assert [row.tick for row in memory.find_traces(query)] == ticks


def test_the_newest_signed_head_of_a_file_is_kept_until_the_file_is_retired(
    memory: MemoryStore, tmp_path: Path
) -> None:
    for n in range(3):
        head = ChainHead(file="t.mcap", records=n, head_sha256=f"{n:064x}", signature="s", key_id="k")
        memory.add_head(head, n)
    memory.add_traces([_row(1)])
    assert kept_head(tmp_path / "memory.sqlite", "t.mcap").head == head.head_sha256
    memory.forget_file("t.mcap")
    assert kept_head(tmp_path / "memory.sqlite", "t.mcap").head == ""
    assert memory.find_traces(TraceQuery()) == ()


def test_the_database_and_what_lies_beside_it_are_not_for_every_user(tmp_path: Path) -> None:
    old = tmp_path / "old.sqlite"
    old.touch(0o644)
    for path in (tmp_path / "new" / "memory.sqlite", old):
        store = MemoryStore(path)
        store.remember("note", "k", {"a": 1}, stamp_ns=1)
        modes = {found.name: found.stat().st_mode & 0o777 for found in path.parent.glob(f"{path.name}*")}
        store.close()
        assert len(modes) == 3
        assert set(modes.values()) == {0o640}
