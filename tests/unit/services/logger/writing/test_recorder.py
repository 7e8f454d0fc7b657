"""From payloads to records, without a bus."""

from collections.abc import Sequence
from pathlib import Path

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from proto import topics
from proto.health import ChainHead, ServiceHealth
from services.logger.memory import MemoryStore, TraceRow
from services.logger.writing.log_file import Record
from services.logger.writing.recorder import PictureGate, Recorder
from services.logger.writing.topic_formats import LOGGED
from tests.unit.services.logger.conftest import trace_of


@settings(max_examples=40, deadline=None)
@given(payload=st.binary(max_size=200))
def test_a_malformed_payload_on_any_topic_is_counted_and_not_logged(payload: bytes) -> None:
    put: list[Record] = []
    warned: list[str] = []
    recorder = Recorder(
        memory=None,
        pictures=PictureGate("all", before_ns=0, after_ns=0),
        show=lambda topic, record: None,
        warn=warned.append,
    )
    recorder.put = put.append
    for topic in LOGGED:
        recorder.take(topic, topic.name.replace("<id>", "x"), payload, sequence=1, stamp_ns=1, now_ns=1)
    assert len(put) + recorder.malformed.total() == len(LOGGED)
    assert len(warned) == recorder.malformed.total()


def test_a_payload_that_nests_too_deep_is_counted_and_not_logged() -> None:
    put: list[Record] = []
    gate = PictureGate("all", before_ns=0, after_ns=0)
    recorder = Recorder(memory=None, pictures=gate, show=lambda topic, record: None, warn=lambda text: None)
    recorder.put = put.append
    sound = msgspec.json.encode(ServiceHealth(service="a", pid=1, uptime_s=1.0, rss_mb=1.0))
    deep = sound[:-1] + b',"new":' + b"[" * 100_000 + b"]" * 100_000 + b"}"
    recorder.take(topics.HEALTH, "health/a", deep, sequence=1, stamp_ns=1, now_ns=1)  # type: ignore[arg-type]
    assert (len(put), recorder.malformed.total()) == (0, 1)


def test_the_head_is_told_only_once_memory_has_its_traces(tmp_path: Path) -> None:
    kept: list[ChainHead | None] = []

    class Memory(MemoryStore):
        def add_traces(self, rows: Sequence[TraceRow]) -> None:
            kept.append(recorder.head)
            super().add_traces(rows)

    gate, memory = PictureGate("all", before_ns=0, after_ns=0), Memory(tmp_path / "memory.sqlite")
    recorder = Recorder(memory=memory, pictures=gate, show=lambda topic, record: None, warn=lambda text: None)
    recorder.take(topics.TRACE, "trace", msgspec.json.encode(trace_of(7)), sequence=1, stamp_ns=1, now_ns=1)  # type: ignore[arg-type]
    head = ChainHead(file="x.mcap", records=1, head_sha256="a")
    recorder.sealed(head, 0)
    assert kept == [None]
    assert recorder.head == head
