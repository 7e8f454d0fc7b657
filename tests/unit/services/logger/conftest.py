"""Small log files, whole and tampered with."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from mcap.opcode import Opcode

from proto.decision import Advisory, Decision, Event, Fused, SafetyMetrics, TraceRecord
from services.logger.format import container, scan, signing
from services.logger.writing.log_file import DiskFile, Form, LogFile, Origin, Record

FORM = Form(message_encoding="json", schema_name="t.T", schema_encoding="jsonschema", schema=b'{"type":"object"}')


def record(topic: str, sequence: int, log_time_ns: int, data: bytes = b"") -> Record:
    """A record of a test topic."""
    return Record(
        topic=topic,
        form=FORM,
        sequence=sequence,
        log_time_ns=log_time_ns,
        publish_time_ns=log_time_ns,
        data=data or b'{"n":%d,"at":%d}' % (sequence, log_time_ns),
    )


FLUSHES = tuple(
    tuple(
        record(topic, flush * 2 + i, flush * 100 + i * 10 + k) for i in range(2) for k, topic in enumerate(("a", "b"))
    )
    for flush in range(3)
)
"""Three flushes of two messages on each of two topics."""


@pytest.fixture(scope="session")
def signer(tmp_path_factory: pytest.TempPathFactory) -> signing.Signer:
    """A signing key."""
    return signing.load_or_make(tmp_path_factory.mktemp("key"))


def write(
    path: Path,
    signer: signing.Signer,
    *,
    close: bool = True,
    flushes: Sequence[Sequence[Record]] = FLUSHES,
    previous_head: str = "",
) -> LogFile:
    """Writes a log and lets go of it."""
    origin = Origin(file="t.mcap", vehicle="ego", public_key=signer.public_hex)
    if previous_head:
        origin = Origin(file="t.mcap", vehicle="ego", public_key=signer.public_hex, previous_head=previous_head)
    file = LogFile(DiskFile(path), origin, signer)
    for i, flush in enumerate(flushes):
        file.append(flush, now_ns=i * 100 + 99)
    if close:
        file.append([], now_ns=999, closed=True)
        file.finish()
    file.release()
    return file


@pytest.fixture
def closed_log(tmp_path: Path, signer: signing.Signer) -> Path:
    """A log that was closed in order."""
    write(tmp_path / "t.mcap", signer)
    return tmp_path / "t.mcap"


@pytest.fixture(scope="session")
def unclosed(tmp_path_factory: pytest.TempPathFactory, signer: signing.Signer) -> tuple[bytes, ...]:
    """The bytes of an unclosed log behind each of its flushes."""
    folder = tmp_path_factory.mktemp("unclosed")
    paths = [folder / f"{n}.mcap" for n in range(len(FLUSHES))]
    for n, path in enumerate(paths):
        write(path, signer, flushes=FLUSHES[: n + 1], close=False)
    return tuple(path.read_bytes() for path in paths)


class Chunks:
    """A log taken apart: what stands before the chunks, each chunk's records, what stands behind. A forger's workbench."""

    def __init__(self, raw: bytes) -> None:
        self.chunks: list[tuple[bool, list[container.Stored]]] = []
        """Compressed or not (chain records are not), and the records."""
        at = scan.frame(raw, scan.frame(raw, len(container.MAGIC)).end).end
        self.opening = raw[:at]
        while at < len(raw) and (where := scan.frame(raw, at)).opcode in (Opcode.CHUNK, Opcode.MESSAGE_INDEX):
            if where.opcode == Opcode.CHUNK:
                payload = scan.chunk(raw, where)
                self.chunks.append((payload.compression != "", list(payload.records)))
            at = where.end
        self.tail = raw[at:]

    def data(self) -> list[list[container.Stored]]:
        """The records of the chunks that are not chain records."""
        return [records for compressed, records in self.chunks if compressed]

    def build(self) -> bytes:
        """The file again, its framing and checksums right for what it holds now."""
        made = self.opening
        for compressed, records in self.chunks:
            made += container.group(records, offset=len(made), compress=compressed).raw
        return made + self.tail


Tamper = Callable[[Chunks], None]


def tampered(source: Path, change: Tamper) -> Path:
    """A copy with one change made to it by someone who knows the format but not the key."""
    chunks = Chunks(source.read_bytes())
    change(chunks)
    target = source.with_name("tampered.mcap")
    target.write_bytes(chunks.build())
    return target


def trace_of(tick: int) -> TraceRecord:
    """A trace that speaks of a speed."""
    return TraceRecord(
        tick=tick,
        stamp_ns=tick * 100,
        cause="snapshot",
        inputs={},
        events=(Event(kind="overspeed", g=1.0, eta=0.5),),
        calls=(),
        fused=Fused(
            target_mps=10.0, legal_limit=None, headway_factor=1.0, directive="Slow down", justification="",
            confidence=1.0, urgency="advice", topic="speed",
        ),
        request=None,
        decision=Decision(tick=tick, kind="SPEAK", reason="", metrics=SafetyMetrics()),
        advisory=Advisory(
            tick=tick, snapshot_stamp_ns=0, kind="SPEAK", directive="Slow down", justification="", urgency="advice",
            topic="speed", hazard="", target_mps=10.0, legal_limit=None, unit="km/h", language="en", confidence=1.0,
        ),
        versions={"rulepack": "DEU-v1@1.0.0"},
    )  # fmt: skip
