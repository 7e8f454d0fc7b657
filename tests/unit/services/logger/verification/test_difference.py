"""Which record is named first, and as what."""

from hypothesis import given
from hypothesis import strategies as st

from services.logger.format.chain import Entry
from services.logger.verification.report import Found, first_difference

ENTRIES = tuple(Entry(opcode=5, id=1, sequence=i, log_time_ns=i, sha256=f"{i:064x}") for i in range(20))
OTHER = Entry(opcode=5, id=1, sequence=99, log_time_ns=99, sha256="ff" * 32)
lists = st.integers(1, 12).map(lambda n: list(ENTRIES[:n]))


def _found(entries: list[Entry]) -> list[Found]:
    return [Found(entry=entry, start=0, place=i) for i, entry in enumerate(entries)]


@given(lists)
def test_the_same_records_in_the_same_order_differ_in_nothing(listed: list[Entry]) -> None:
    assert first_difference(listed, _found(listed), unreadable=False) is None


@given(lists, st.data())
def test_one_dropped_record_is_the_one_named(listed: list[Entry], data: st.DataObject) -> None:
    i = data.draw(st.integers(0, len(listed) - 1))
    found = first_difference(listed, _found(listed[:i] + listed[i + 1 :]), unreadable=False)
    assert found is not None
    assert (found.what, found.entry) == ("dropped", listed[i])


@given(lists, st.data())
def test_one_changed_record_is_the_one_named(listed: list[Entry], data: st.DataObject) -> None:
    i = data.draw(st.integers(0, len(listed) - 1))
    found = first_difference(listed, _found([*listed[:i], OTHER, *listed[i + 1 :]]), unreadable=False)
    assert found is not None
    assert (found.what, found.entry) == ("changed", listed[i])


@given(lists, st.data())
def test_one_inserted_record_is_the_one_named(listed: list[Entry], data: st.DataObject) -> None:
    i = data.draw(st.integers(0, len(listed)))
    found = first_difference(listed, _found([*listed[:i], OTHER, *listed[i:]]), unreadable=False)
    assert found is not None
    assert (found.what, found.entry) == ("inserted", OTHER)


@given(lists, st.data())
def test_any_rearrangement_is_found_at_its_first_place(listed: list[Entry], data: st.DataObject) -> None:
    order = data.draw(st.permutations(listed))
    found = first_difference(listed, _found(order), unreadable=False)
    first = next((i for i, (one, other) in enumerate(zip(listed, order, strict=True)) if one != other), None)
    assert (found is None) == (first is None)
    if found is not None and first is not None:
        assert (found.what, found.entry) == ("reordered", listed[first])
