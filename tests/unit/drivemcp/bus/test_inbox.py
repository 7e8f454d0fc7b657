"""What waits for a node's worker: coalescing, the bound, and that nothing is deaf afterwards."""

from unittest.mock import Mock

from hypothesis import given
from hypothesis import strategies as st

from drivemcp.bus.inbox import INBOX_LIMIT, Inbox, Parcel, Timers
from proto.wire import PubHead

LATEST = ("a", "b", "c")
ALL = ("x", "y")
PUTS = st.lists(st.one_of(st.sampled_from(LATEST + ALL), st.none()), max_size=60)
"""Keys put in turn; None: one is taken."""


def _heard(parcel: Parcel) -> None:
    """What every parcel here is delivered to."""


def _put(inbox: Inbox, key: str, n: int) -> None:
    inbox.put(Parcel(key, str(n).encode(), None, n, _heard), latest=key in LATEST)


def _taken(inbox: Inbox) -> list[Parcel]:
    taken = []
    while isinstance(parcel := inbox.take(0.0), Parcel):
        taken.append(parcel)
    return taken


@given(puts=PUTS, limit=st.integers(1, 5))
def test_a_latest_key_yields_its_newest_publication_unless_overflow_took_it_and_is_never_deaf(
    puts: list[str | None], limit: int
) -> None:
    inbox = Inbox(limit)
    order: list[str] = []
    newest: dict[str, int] = {}
    for n, key in enumerate(puts):
        if key is None:
            taken = inbox.take(0.0)
            assert (taken.key if isinstance(taken, Parcel) else None) == (order.pop(0) if order else None)
            continue
        _put(inbox, key, n)
        newest[key] = n
        if key not in LATEST or key not in order:
            order.append(key)
        del order[:-limit]
    left = _taken(inbox)
    assert [parcel.key for parcel in left] == order
    assert all(parcel.arrived_ns == newest[parcel.key] for parcel in left if parcel.key in LATEST)
    for key in LATEST + ALL:
        _put(inbox, key, 1000)
        assert [(parcel.key, parcel.arrived_ns) for parcel in _taken(inbox)] == [(key, 1000)]


@given(puts=PUTS, limit=st.integers(1, 5))
def test_every_publication_is_taken_or_counted_as_dropped(puts: list[str | None], limit: int) -> None:
    inbox = Inbox(limit)
    taken = put = 0
    for n, key in enumerate(puts):
        if key is None:
            taken += inbox.take(0.0) is not None
        else:
            _put(inbox, key, n)
            put += 1
    assert taken + len(_taken(inbox)) + inbox.dropped == put


@given(puts=st.lists(st.sampled_from(LATEST + ALL), max_size=20), late=st.sampled_from(LATEST + ALL))
def test_what_is_left_at_the_end_is_handed_over_and_nothing_is_taken_in_any_more(puts: list[str], late: str) -> None:
    inbox, other = Inbox(), Inbox()
    for n, key in enumerate(puts):
        _put(inbox, key, n)
        _put(other, key, n)
    inbox.close()
    _put(inbox, late, 1000)
    handed: list[object] = []
    assert inbox.finish(handed.append, 10.0) == 0
    assert handed == _taken(other)


@given(keys=st.lists(st.sampled_from(ALL), max_size=20))
def test_what_is_not_handed_over_in_time_counts_as_dropped(keys: list[str]) -> None:
    inbox = Inbox()
    for n, key in enumerate(keys):
        _put(inbox, key, n)
    inbox.close()
    assert inbox.finish(lambda _: None, 0.0) == inbox.dropped == len(keys)
    assert _taken(inbox) == []


def test_a_latest_topic_is_heard_again_after_a_flood_pushed_it_out() -> None:
    inbox = Inbox()
    _put(inbox, "a", 0)
    for n in range(INBOX_LIMIT):
        _put(inbox, "x", n)
    assert {parcel.key for parcel in _taken(inbox)} == {"x"}
    _put(inbox, "a", 1)
    assert [parcel.arrived_ns for parcel in _taken(inbox)] == [1]


@given(
    periods=st.lists(st.integers(1, 50), min_size=1, max_size=5),
    ran_ns=st.integers(0, 200),
    back_ns=st.integers(1, 10**6),
)
def test_a_clock_that_is_stepped_back_holds_no_timer_up(periods: list[int], ran_ns: int, back_ns: int) -> None:
    stepped, steady = Timers(), Timers()
    for period in periods:
        function = Mock()
        stepped.add(period, period, function)
        steady.add(period, period, function)
    assert stepped.due(ran_ns) == steady.due(ran_ns)
    for later_ns in range(100):
        assert stepped.due(ran_ns - back_ns + later_ns) == steady.due(ran_ns + later_ns)


def _from(publisher: str, key: str, n: int) -> Parcel:
    head = PubHead(seq=n, stamp_ns=n, sent_ns=n, publisher=publisher, epoch=1)
    return Parcel(key, str(n).encode(), head, n, _heard)


@given(floods=st.integers(0, 200), others=st.lists(st.sampled_from(("a", "b", "c")), max_size=9))
def test_one_publisher_that_floods_takes_no_place_of_the_others(floods: int, others: list[str]) -> None:
    inbox = Inbox(limit=16, most_of_one=4)
    for n in range(floods):
        inbox.put(_from("flood", "x", n), latest=False)
    for n, publisher in enumerate(others):
        inbox.put(_from(publisher, "x", n), latest=False)
    taken = _taken(inbox)
    heads = [parcel.head.publisher for parcel in taken if parcel.head is not None]
    assert heads.count("flood") == min(floods, 4)
    for publisher in set(others):
        assert heads.count(publisher) == min(others.count(publisher), 4)
    assert len(taken) + inbox.dropped == floods + len(others)
    inbox.put(_from("flood", "x", 999), latest=False)
    assert len(_taken(inbox)) == 1, "it is heard again once its messages were taken"
