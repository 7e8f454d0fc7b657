"""What speedings came from, by hand: 20 m/s are driven, a limit of 10 m/s begins at 12 s and is kept from 15 s on."""

import gzip
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.metrics import At, Record
from evaluation.metrics.law import speeding_episodes
from proto.decision import Advisory
from studies.speedings import main, speedings
from tests.unit.evaluation.metrics.logs import said, truths


def drive(*words: At[Advisory]) -> Record:
    def at(time_s: float) -> dict[str, Any]:
        return {"speed_mps": 20.0 if time_s < 15.0 else 10.0, "law_limit_mps": 20.0 if time_s < 12.0 else 10.0}

    return Record(truths=truths(20.0, at), advisories=words)


def ahead(time_s: float, mps: float = 10.0) -> At[Advisory]:
    return said(time_s, topic="ahead", ahead_mps=mps, target_mps=mps)


def test_a_driver_who_could_have_braked_softly_was_told_in_time() -> None:
    # 10 m/s to lose in 12.0 - 4.0 - 1.25 = 6.75 s: 1.48 m/s²
    (found,) = speedings(drive(ahead(4.0)))
    assert (found.from_s, found.to_s, found.limit_mps, found.by_mps) == pytest.approx((12.0, 14.95, 10.0, 10.0))
    assert found.told_s == 4.0
    assert found.needs_mps2 == pytest.approx(10.0 / 6.75)
    assert found.cause == "told in time"


def test_who_would_have_had_to_brake_hard_was_told_late() -> None:
    # 10 m/s in 12.0 - 8.0 - 1.25 = 2.75 s: 3.64 m/s²; at 11 s no time is left at all
    (found,) = speedings(drive(ahead(8.0)))
    assert found.needs_mps2 == pytest.approx(10.0 / 2.75)
    assert found.cause == "told late"
    (found,) = speedings(drive(ahead(11.0)))
    assert found.needs_mps2 == float("inf")
    assert found.cause == "told late"


def test_only_words_on_that_limit_count_and_only_before_it_is_exceeded() -> None:
    other = (ahead(4.0, 15.0), said(5.0, topic="limit", target_mps=9.0), said(6.0, topic="person", target_mps=0.0))
    for words in ((), other, (ahead(4.0)._replace(time_s=12.5),)):
        (found,) = speedings(drive(*words))
        assert found.told_s is None
        assert found.cause == "not told"


def test_a_limit_asked_for_where_it_is_in_force_and_a_sign_that_is_explained_are_words_on_it() -> None:
    at = lambda time_s: {"speed_mps": 9.0 if time_s < 10.0 else 12.0 if time_s < 14.0 else 9.0}  # noqa: E731
    here = Record(truths=truths(20.0, at, law_limit_mps=10.0), advisories=(said(6.0, target_mps=9.0),))
    (found,) = speedings(here)
    assert found.told_s == 6.0
    assert found.needs_mps2 == 0.0
    assert found.cause == "told in time"
    explained = said(4.0, topic="foreign", target_mps=19.0, directive="Sign: Speed limit 36 km/h: do not drive faster.")
    (found,) = speedings(drive(explained))
    assert found.told_s == 4.0
    (found,) = speedings(drive(said(4.0, topic="foreign", target_mps=19.0, directive="Sign: Speed limit 136 km/h.")))
    assert found.told_s is None, "36 is no part of 136"


def test_what_was_said_half_a_minute_before_does_not_count() -> None:
    late = truths(60.0, lambda time_s: {"speed_mps": 9.0 if time_s < 40.0 else 12.0}, law_limit_mps=10.0)
    (found,) = speedings(Record(truths=late, advisories=(said(14.0, target_mps=10.0),)))
    assert found.told_s is None
    (found,) = speedings(Record(truths=late, advisories=(said(16.0, target_mps=10.0),)))
    assert found.told_s == 16.0


@given(st.lists(st.tuples(st.floats(0.0, 30.0), st.sampled_from((None, 8.0, 20.0)), st.integers(1, 40)), max_size=12))
def test_as_many_are_found_as_count_as_infractions(pieces: list[tuple[float, float | None, int]]) -> None:
    steps = [(speed, limit) for speed, limit, count in pieces for _ in range(count)]

    def at(time_s: float) -> dict[str, Any]:
        speed, limit = steps[round(time_s / 0.05) - 1]
        return {"speed_mps": speed, "law_limit_mps": limit}

    record = Record(truths=truths(len(steps) * 0.05, at))
    assert len(list(speedings(record))) == speeding_episodes(record)


def test_a_run_whose_truth_is_cut_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "log.mcap").write_bytes(b"")
    (tmp_path / "truth.msgpack.gz").write_bytes(gzip.compress(b"truth" * 100)[:-20])
    assert main([str(tmp_path / "log.mcap")]) == 2
    assert "log.mcap: " in capsys.readouterr().err


def test_a_log_that_is_not_there_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "none.mcap")]) == 2
    assert "none.mcap" in capsys.readouterr().err
