"""Resident memory, of the text that Linux tells it in."""

from benchmarks.footprint import resident_mb


def test_linux_tells_kibibytes_and_the_promise_is_in_megabytes() -> None:
    assert resident_mb("Name:\tpython\nVmRSS:\t   78125 kB\nThreads:\t1\n") == 80.0


def test_a_process_that_has_ended_has_none() -> None:
    assert resident_mb("Name:\tpython\nState:\tZ (zombie)\n") == 0.0
