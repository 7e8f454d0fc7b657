"""The logger's end of the live view."""

import threading
import time
import urllib.request
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from proto import topics
from proto.vehicle import Ego
from services.logger.view.pipe import QUEUE, Thinning, ViewPipe
from services.logger.view.settings import Said, ViewSettings
from services.logger.writing.log_file import Record
from services.logger.writing.topic_formats import json_form

WAIT_S = 120.0
LISTENING = "0A"


@given(rate_hz=st.floats(1, 30), source_hz=st.floats(1, 60))
def test_thinning_lets_through_the_rate_asked_for_and_no_more(rate_hz: float, source_hz: float) -> None:
    thinning = Thinning(rate_hz)
    seconds = 20
    count = sum(thinning.passes("a", int(i / source_hz * 1e9)) for i in range(int(seconds * source_hz)))
    expected = min(rate_hz, source_hz) * seconds
    assert 0.6 * expected - 2 <= count <= expected * 1.05 + 2


def _ego(i: int) -> Record:
    return Record(
        topic="can/ego",
        form=json_form(Ego),
        sequence=i,
        log_time_ns=i,
        publish_time_ns=i * 10_000_000,
        data=msgspec.json.encode(Ego(speed_mps=float(i))),
    )


def test_a_view_that_cannot_start_is_told_and_costs_the_log_nothing(tmp_path: Path) -> None:
    heard = threading.Event()
    said: list[Said] = []

    def hear(what: Said) -> None:
        said.append(what)
        heard.set()

    pipe = ViewPipe(ViewSettings(mode="file", recording=str(tmp_path / "no" / "such" / "folder" / "x.rrd")), said=hear)
    started_s = time.monotonic()
    for i in range(QUEUE * 3):
        pipe.offer(topics.EGO.name, _ego(i))
    assert time.monotonic() - started_s < 20.0, "one that blocks waits for the view's start"
    assert heard.wait(WAIT_S)
    assert said[0].problem
    pipe.close(WAIT_S)


def test_records_become_a_recording(tmp_path: Path) -> None:
    ready = threading.Event()
    path = tmp_path / "x.rrd"
    pipe = ViewPipe(ViewSettings(mode="file", recording=str(path)), said=lambda said: ready.set())
    assert ready.wait(WAIT_S)
    for i in range(20):
        pipe.offer(topics.EGO.name, _ego(i))
    pipe.offer(topics.GRAPH.name, _ego(0))  # not shown: passed over
    pipe.close(WAIT_S, drain=True)
    assert path.read_bytes().startswith(b"RRF2")
    assert b"speed/ego" in path.read_bytes()
    assert pipe.dropped == 0


def test_the_viewer_is_served_on_loopback_only_and_ends_with_the_logger() -> None:
    ready = threading.Event()
    said: list[Said] = []

    def hear(what: Said) -> None:
        said.append(what)
        ready.set()

    pipe = ViewPipe(ViewSettings(mode="web"), said=hear)
    assert ready.wait(WAIT_S)
    page = urlsplit(said[0].viewer)
    sink = urlsplit(parse_qs(page.query)["url"][0].removeprefix("rerun+"))
    with urllib.request.urlopen(said[0].viewer, timeout=WAIT_S) as answer:
        assert b"<html" in answer.read()
    for port in (page.port, sink.port):
        assert port is not None
        assert _listening_on(port) == {"127.0.0.1"}
    pipe.close(WAIT_S)
    for port in (page.port, sink.port):
        assert _listening_on(port or 0) == set()


def _listening_on(port: int) -> set[str]:
    """Addresses on which somebody listens on a port of this machine, as the kernel tells."""
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text(encoding="ascii").splitlines()[1:]:
            _, local, _, state, *_ = line.split()
            address, number = local.split(":")
            if int(number, 16) == port and state == LISTENING:
                found.add(".".join(str(part) for part in reversed(bytes.fromhex(address))))
    return found
