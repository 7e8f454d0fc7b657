"""What `audit verify` finds."""

import io
import tracemalloc
from pathlib import Path

import msgspec
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk

from services.logger.format import chain, container, signing
from services.logger.verification.report import UNSEALED, Report
from services.logger.verification.verifier import verify
from tests.unit.services.logger.conftest import FLUSHES, Chunks, tampered, write

MESSAGES = [(i, k, record) for i, flush in enumerate(FLUSHES) for k, record in enumerate(flush)]


def _messages(chunk: list[container.Stored]) -> list[int]:
    return [i for i, record in enumerate(chunk) if record.opcode == Opcode.MESSAGE]


def test_a_log_as_it_was_written_verifies(closed_log: Path) -> None:
    report = verify(closed_log)
    assert report.intact
    assert report.closed
    assert report.messages == 12
    assert report.chained == 4


def test_any_mcap_reader_opens_it_and_its_checksums_hold(closed_log: Path) -> None:
    reader = make_reader(io.BytesIO(closed_log.read_bytes()), validate_crcs=True)
    topics = [channel.topic for _, channel, _ in reader.iter_messages()]
    assert topics.count("a") == topics.count("b") == 6
    assert topics.count(chain.TOPIC) == 4


def test_a_flipped_bit_in_any_byte_is_found(tmp_path: Path, signer: signing.Signer) -> None:
    whole, flipped = tmp_path / "t.mcap", tmp_path / "flipped.mcap"
    write(whole, signer, flushes=FLUSHES[:1])
    raw = whole.read_bytes()
    missed = []
    for at in range(len(raw)):
        flipped.write_bytes(raw[:at] + bytes([raw[at] ^ (1 << at % 8)]) + raw[at + 1 :])
        if verify(flipped).intact:
            missed.append(at)
    assert missed == []


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_other_byte_anywhere_is_found(closed_log: Path, data: st.DataObject) -> None:
    raw = closed_log.read_bytes()
    at = data.draw(st.integers(0, len(raw) - 1))
    other = data.draw(st.integers(0, 255).filter(lambda value: value != raw[at]))
    changed = closed_log.with_name("changed.mcap")
    changed.write_bytes(raw[:at] + bytes([other]) + raw[at + 1 :])
    assert not verify(changed).intact


def test_a_flipped_bit_in_an_unclosed_log_is_found_or_leaves_a_tail_that_nothing_vouches_for(
    tmp_path: Path, signer: signing.Signer
) -> None:
    whole, flipped = tmp_path / "t.mcap", tmp_path / "flipped.mcap"
    write(whole, signer, close=False)
    raw = whole.read_bytes()
    assert verify(whole).tail_bytes == 0
    for at in range(0, len(raw), 3):
        flipped.write_bytes(raw[:at] + bytes([raw[at] ^ (1 << at % 8)]) + raw[at + 1 :])
        report = verify(flipped)
        assert not report.intact or report.tail_bytes > 0, at
        if report.intact:  # taken for a cut: then no record of that flush counts as verified
            assert report.messages <= 8, at


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_flipped_bit_before_the_last_whole_chain_record_of_an_unclosed_log_is_found(
    tmp_path: Path, unclosed: tuple[bytes, ...], data: st.DataObject
) -> None:
    path = tmp_path / "t.mcap"
    raw = unclosed[-1][: data.draw(st.integers(len(unclosed[0]), len(unclosed[-1])))]
    last = max(n for n, until in enumerate(unclosed) if len(until) <= len(raw))
    vouched = unclosed[last].rindex(b'{"body":{"n":%d,' % last)
    path.write_bytes(raw)
    assert verify(path).intact
    at, bit = data.draw(st.integers(0, vouched - 1)), data.draw(st.integers(0, 7))
    path.write_bytes(raw[:at] + bytes([raw[at] ^ (1 << bit)]) + raw[at + 1 :])
    assert not verify(path).intact


@pytest.mark.parametrize("bit", range(64))
def test_a_chunk_whose_length_was_changed_hides_no_later_flush(
    tmp_path: Path, unclosed: tuple[bytes, ...], bit: int
) -> None:
    path = tmp_path / "t.mcap"
    raw, at = bytearray(unclosed[-1]), len(unclosed[0])
    raw[at + 1 + bit // 8] ^= 1 << bit % 8
    path.write_bytes(raw)
    report = verify(path)
    assert report.first_bad is not None
    assert report.first_bad.offset == at
    assert (report.messages, report.tail_bytes) == (4, 0)


def test_a_changed_record_is_found_though_the_file_ends_inside_the_index_behind_its_chain_record(
    tmp_path: Path, unclosed: tuple[bytes, ...]
) -> None:
    path = tmp_path / "t.mcap"
    raw, at = bytearray(unclosed[-1][:-3]), len(unclosed[-2])
    raw[at + 70] ^= 1
    path.write_bytes(raw)
    report = verify(path)
    assert report.first_bad is not None
    assert report.first_bad.offset == at
    assert report.messages == 8


@pytest.mark.parametrize(("flush", "place", "original"), MESSAGES)
def test_a_changed_record_is_named(closed_log: Path, flush: int, place: int, original: object) -> None:
    def change(chunks: Chunks) -> None:
        records = chunks.data()[flush]
        i = _messages(records)[place]
        content = records[i].content[:-1] + b"!"
        records[i] = msgspec.structs.replace(records[i], content=content)

    _names(verify(tampered(closed_log, change)), "changed", original)


@pytest.mark.parametrize(("flush", "place", "original"), MESSAGES)
def test_a_dropped_record_is_named(closed_log: Path, flush: int, place: int, original: object) -> None:
    def drop(chunks: Chunks) -> None:
        records = chunks.data()[flush]
        del records[_messages(records)[place]]

    _names(verify(tampered(closed_log, drop)), "dropped", original)


@pytest.mark.parametrize(("flush", "place", "original"), [one for one in MESSAGES if one[1] < 3])
def test_the_first_of_two_exchanged_records_is_named(
    closed_log: Path, flush: int, place: int, original: object
) -> None:
    def exchange(chunks: Chunks) -> None:
        records = chunks.data()[flush]
        i = _messages(records)[place]
        records[i], records[i + 1] = records[i + 1], records[i]

    _names(verify(tampered(closed_log, exchange)), "reordered", original)


def test_an_inserted_record_is_named(closed_log: Path) -> None:
    forged = container.message(channel_id=1, sequence=77, log_time_ns=7, publish_time_ns=7, data=b"{}")

    def insert(chunks: Chunks) -> None:
        chunks.data()[1].insert(2, forged)

    bad = verify(tampered(closed_log, insert)).first_bad
    assert bad is not None
    assert (bad.what, bad.topic, bad.sequence, bad.log_time_ns) == ("inserted", "a", 77, 7)


def test_a_changed_channel_definition_is_named(closed_log: Path) -> None:
    def rename(chunks: Chunks) -> None:
        records = chunks.data()[0]
        i = next(i for i, record in enumerate(records) if record.opcode == Opcode.CHANNEL)
        content = records[i].content.replace(b"\x01\x00\x00\x00a", b"\x01\x00\x00\x00z")
        records[i] = msgspec.structs.replace(records[i], content=content)

    bad = verify(tampered(closed_log, rename)).first_bad
    assert bad is not None
    assert bad.what == "changed"
    assert "definition of channel 1" in bad.topic


@pytest.mark.parametrize("n", [0, 1, 2])
def test_a_dropped_flush_is_told_by_its_chain_record_and_its_size(closed_log: Path, n: int) -> None:
    def drop(chunks: Chunks) -> None:
        del chunks.chunks[2 * n : 2 * n + 2]

    bad = verify(tampered(closed_log, drop)).first_bad
    assert bad is not None
    assert (bad.what, bad.topic, bad.sequence) == ("dropped", chain.TOPIC, n)
    assert "4 messages" in bad.detail


def test_exchanged_flushes_are_told(closed_log: Path) -> None:
    def exchange(chunks: Chunks) -> None:
        chunks.chunks[0:2], chunks.chunks[2:4] = chunks.chunks[2:4], chunks.chunks[0:2]

    bad = verify(tampered(closed_log, exchange)).first_bad
    assert bad is not None
    assert (bad.what, bad.topic, bad.sequence) == ("reordered", chain.TOPIC, 0)


def test_a_repeated_flush_is_told(closed_log: Path) -> None:
    def repeat(chunks: Chunks) -> None:
        chunks.chunks[2:2] = chunks.chunks[0:2]

    bad = verify(tampered(closed_log, repeat)).first_bad
    assert bad is not None
    assert bad.what == "inserted"


def test_a_chain_record_made_to_fit_changed_data_lacks_the_signature(closed_log: Path, tmp_path: Path) -> None:
    stranger = signing.load_or_make(tmp_path / "stranger")

    def rewrite(chunks: Chunks) -> None:
        data, link = chunks.chunks[2][1], chunks.chunks[3][1]
        i = _messages(data)[0]
        data[i] = msgspec.structs.replace(data[i], content=data[i].content[:-1] + b"!")
        head = container.MESSAGE_HEAD.size
        _, body = chain.decode(link[0].content[head:])
        body = msgspec.structs.replace(body, entries=tuple(chain.entry(record) for record in data))
        sealed = chain.encode(chain.seal(body, key_id=stranger.key_id, sign=stranger.sign))
        link[0] = msgspec.structs.replace(link[0], content=link[0].content[:head] + sealed)

    bad = verify(tampered(closed_log, rewrite)).first_bad
    assert bad is not None
    assert (bad.what, bad.topic, bad.sequence) == ("changed", chain.TOPIC, 1)


HEADS = {
    "channel": lambda head: (1, *head[1:]),
    "unknown channel": lambda head: (99, *head[1:]),
    "number": lambda head: (head[0], 4_000_000_000, *head[2:]),
    "publish time": lambda head: (*head[:3], head[3] + 1),
}
"""Ways to make the message around a chain record another one, its own text as it was."""


@pytest.mark.parametrize("how", HEADS)
@pytest.mark.parametrize("n", range(len(FLUSHES)))
def test_a_chain_record_passes_for_no_other_message(tmp_path: Path, signer: signing.Signer, n: int, how: str) -> None:
    path = tmp_path / "t.mcap"
    write(path, signer, flushes=FLUSHES[: n + 1], close=False)

    def forge(chunks: Chunks) -> None:
        (link,) = chunks.chunks[-1][1]
        size = container.MESSAGE_HEAD.size
        channel, sequence, logged_ns, published_ns = HEADS[how](container.MESSAGE_HEAD.unpack(link.content[:size]))
        chunks.chunks[-1][1][0] = container.message(
            channel_id=channel, sequence=sequence, log_time_ns=logged_ns, publish_time_ns=published_ns,
            data=link.content[size:],
        )  # fmt: skip

    place = verify(tampered(path, forge)).first_bad
    assert place is not None
    assert (place.what, place.topic, place.sequence) == ("changed", chain.TOPIC, n)


def test_a_log_written_anew_with_another_key_is_found_by_the_expected_key(
    tmp_path: Path, signer: signing.Signer
) -> None:
    stranger = signing.load_or_make(tmp_path / "stranger")
    write(tmp_path / "forged.mcap", stranger)
    assert verify(tmp_path / "forged.mcap").intact  # in itself it is a good log
    assert not verify(tmp_path / "forged.mcap", public_key=signer.public_hex).intact


def test_a_log_cut_anywhere_verifies_as_a_prefix_and_is_called_unclosed(closed_log: Path, tmp_path: Path) -> None:
    raw, cut = closed_log.read_bytes(), tmp_path / "cut.mcap"
    counts = []
    for size in range(0, len(raw), 5):
        cut.write_bytes(raw[:size])
        report = verify(cut)
        assert report.intact == (report.chained > 0), (size, report.first_bad)
        assert report.first_bad in (None, UNSEALED)
        assert not report.closed
        counts.append(report.messages)
    assert counts == sorted(counts)
    assert set(counts) == {0, 4, 8, 12}


def test_an_expected_head_settles_a_lost_tail(tmp_path: Path, signer: signing.Signer) -> None:
    written = write(tmp_path / "t.mcap", signer, close=False)
    head = written.head.head_sha256
    assert verify(tmp_path / "t.mcap", expected_head=head).intact
    raw = (tmp_path / "t.mcap").read_bytes()
    (tmp_path / "t.mcap").write_bytes(raw[: len(raw) - 10])
    report = verify(tmp_path / "t.mcap", expected_head=head)
    assert report.expected_head_missing
    assert not report.intact
    assert report.messages == 8


def test_an_end_put_behind_a_shortened_log_is_found(closed_log: Path) -> None:
    def shorten(chunks: Chunks) -> None:
        del chunks.chunks[4:]

    bad = verify(tampered(closed_log, shorten)).first_bad
    assert bad is not None
    assert bad.what == "dropped"


def test_the_head_goes_on_from_the_file_before(tmp_path: Path, signer: signing.Signer) -> None:
    first = write(tmp_path / "1.mcap", signer)
    write(tmp_path / "2.mcap", signer, previous_head=first.head.head_sha256)
    origin = verify(tmp_path / "2.mcap").origin
    assert origin is not None
    assert origin.previous_head == verify(tmp_path / "1.mcap").head == first.head.head_sha256


@settings(max_examples=60, deadline=None)
@given(data=st.binary(max_size=600))
def test_no_file_whatever_makes_the_verifier_fail(data: bytes, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.getbasetemp() / "any.mcap"
    for written in (data, container.MAGIC + data):
        path.write_bytes(written)
        report = verify(path)
        assert not report.closed
        assert not report.intact  # nothing in it verifies


def _names(report: Report, what: str, original: object) -> None:
    bad = report.first_bad
    assert bad is not None
    expected = (what, original.topic, original.sequence, original.log_time_ns)  # type: ignore[attr-defined]
    assert (bad.what, bad.topic, bad.sequence, bad.log_time_ns) == expected


@pytest.mark.parametrize("honest", [True, False])
def test_a_chunk_that_unpacks_to_a_gigabyte_is_refused_with_little_memory(closed_log: Path, honest: bool) -> None:
    packer = zstandard.ZstdCompressor().compressobj(size=1 << 30 if honest else -1)
    packed = b"".join(packer.compress(bytes(1 << 20)) for _ in range(1 << 10)) + packer.flush()
    bomb = Chunk(
        compression="zstd", data=packed, message_start_time=0, message_end_time=0, uncompressed_crc=0,
        uncompressed_size=1 << 30,
    )  # fmt: skip
    closed_log.write_bytes(Chunks(closed_log.read_bytes()).opening + container.encode(bomb))
    tracemalloc.start()
    try:
        report = verify(closed_log)
        _, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert not report.intact
    assert most_bytes < 50_000_000
