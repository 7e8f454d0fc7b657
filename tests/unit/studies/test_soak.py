"""How growth is told from memory by time."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from studies.soak import Sample, growth, sampled, settles_s, sheet


def memory(mb_per_hour: float, first_mb: float = 100.0, until_s: int = 1800) -> list[Sample]:
    """A process that fills its caches for ten minutes and grows by so much from then on."""
    return [
        Sample(at_s=at, own_mb=first_mb + min(at, 600) * 0.1 + mb_per_hour * max(0, at - 600) / 3600, resident_mb=0.0)
        for at in range(0, until_s + 1, 10)
    ]


@given(st.floats(-50.0, 50.0), st.floats(1.0, 1000.0))
def test_growth_counts_from_when_memory_has_settled(mb_per_hour: float, first_mb: float) -> None:
    found = growth("can", memory(mb_per_hour, first_mb), settles_s(1800.0))
    assert found is not None
    assert found.mb_per_hour == pytest.approx(mb_per_hour, abs=1e-3)


def test_memory_that_is_given_back_is_no_growth() -> None:
    samples = [
        Sample(
            at_s=each.at_s,
            own_mb=each.own_mb + (70.0 if each.at_s % 300 > 200 or each.at_s > 1700 else 0.0),
            resident_mb=0.0,
        )
        for each in memory(2.0)
    ]
    found = growth("simulator", samples, 600.0)
    assert found is not None
    assert found.mb_per_hour == pytest.approx(2.0, abs=0.5)
    assert found.most_mb > 220.0


def test_of_a_shorter_drive_a_third_is_for_settling() -> None:
    assert (settles_s(1800.0), settles_s(7200.0), settles_s(900.0)) == (600.0, 600.0, 300.0)


def test_a_process_that_was_hardly_seen_has_no_growth() -> None:
    assert growth("can", memory(1.0)[:2], 0.0) is None


def test_the_fastest_growth_stands_first() -> None:
    grown = [found for name, mb in (("can", 1.0), ("logger", 7.0)) if (found := growth(name, memory(mb), 600.0))]
    assert [row[0] for row in sheet(grown, 600.0).rows] == ["logger", "can"]


def test_memory_is_that_of_the_process_and_grows_with_it() -> None:
    before = sampled(os.getpid(), 0.0)
    kept = bytearray(os.urandom(64 << 20))
    after = sampled(os.getpid(), 1.0)
    assert after.own_mb - before.own_mb == pytest.approx(67.0, abs=8.0)
    assert len(kept) == 64 << 20
