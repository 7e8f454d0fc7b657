"""What waits for a node's worker: coalescing, the bound, and that nothing is deaf afterwards."""

from hypothesis import given
from hypothesis import strategies as st

from drivemcp.inbox import INBOX_LIMIT, Inbox, Parcel

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


def test_a_latest_topic_is_heard_again_after_a_flood_pushed_it_out() -> None:
    inbox = Inbox()
    _put(inbox, "a", 0)
    for n in range(INBOX_LIMIT):
        _put(inbox, "x", n)
    assert {parcel.key for parcel in _taken(inbox)} == {"x"}
    _put(inbox, "a", 1)
    assert [parcel.arrived_ns for parcel in _taken(inbox)] == [1]
