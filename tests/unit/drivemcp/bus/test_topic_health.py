"""The health bits of a topic."""

import tracemalloc
from typing import Any

from drivemcp.bus.topic_health import TopicMonitor
from proto import topics
from proto.topics import Topic
from proto.wire import PubHead

HOUR_NS = 3600 * 10**9


def heard(monitor: TopicMonitor, seq: int, now_ns: int) -> None:
    """One publication arrives."""
    head = PubHead(seq=seq, stamp_ns=now_ns, sent_ns=0, publisher="can", epoch=1)
    monitor.saw("can/ego", head, now_ns, wall=True)


def test_a_topic_that_fell_silent_is_not_alive_for_a_clock_that_is_stepped_back() -> None:
    topic: Topic[Any] = topics.EGO
    monitor = TopicMonitor(topic)
    heard(monitor, 1, HOUR_NS)
    assert monitor.health(HOUR_NS).alive
    assert not monitor.health(0).alive
    heard(monitor, 2, 1)
    assert monitor.health(1).alive


def test_a_publisher_that_makes_up_names_takes_bounded_memory_and_what_comes_last_is_counted_right() -> None:
    topic: Topic[Any] = topics.EGO
    monitor = TopicMonitor(topic)
    tracemalloc.start()
    try:
        for n in range(50_000):
            head = PubHead(seq=1, stamp_ns=n, sent_ns=0, publisher=f"nobody-{n}" * 4, epoch=n)
            monitor.saw("drivemcp/ego/can/ego", head, n, wall=False)
        kept_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert kept_bytes < 1_000_000
    for seq in (1, 2, 5):
        monitor.saw(
            "drivemcp/ego/can/ego", PubHead(seq=seq, stamp_ns=0, sent_ns=0, publisher="can", epoch=7), 0, wall=False
        )
    assert monitor.lost == 2
