"""A worst moment without a camera: drawn from truth, its messages told; in the report where a run has no picture."""

import gzip
import random
from pathlib import Path

import msgspec
import pytest

from evaluation.campaign.store import Kept
from evaluation.metrics import Record
from evaluation.report import report
from evaluation.report.above import seen_from_above
from tests.unit.evaluation.evaluate.made import kept, moment, table
from tests.unit.evaluation.metrics.logs import person, said, steady

pytest.importorskip("matplotlib")


def drive(*people: float, words: tuple[float, ...] = ()) -> Record:
    """20 m/s for 20 s; at the moment, 12 s, people stand so far ahead."""
    actors = tuple(person(x_m, 20.0, number=int(x_m)) for x_m in people)
    told = tuple(said(time_s, directive=f"Brake: told at {time_s}") for time_s in words)
    return Record(truths=steady(20.0, actors=actors), advisories=told)


def test_who_is_there_and_what_was_said_shows() -> None:
    nobody, somebody = (seen_from_above(drive(*people), moment()) for people in ((), (15.0, 30.0)))
    assert somebody.count("<path") == nobody.count("<path") + 2, "a body each; who stands has no arrow"
    assert "Nothing was said." in nobody
    text = seen_from_above(drive(words=(1.0, 4.0, 11.5, 18.0)), moment())
    assert [at for at in (1.0, 4.0, 11.5, 18.0) if f"Brake: told at {at}" in text] == [4.0, 11.5], (
        "10 s before, 5 after"
    )


def test_moments_at_either_end_of_a_run_are_drawn_too() -> None:
    for time_s in (0.05, 20.0):
        assert seen_from_above(drive(9.0), msgspec.structs.replace(moment(), time_s=time_s)).startswith("<svg")
    assert seen_from_above(Record(), moment()) == "", "no truth: nothing is drawn"


CUT = gzip.compress(b"truth" * 100)[:-20]


SPOILED = gzip.compress(random.Random(0).randbytes(1000))
SPOILED = SPOILED[:12] + bytes(each ^ 255 for each in SPOILED[12:40]) + SPOILED[40:]


@pytest.mark.parametrize("truth", [b"no truth", CUT, SPOILED], ids=["no gzip file", "cut", "spoiled"])
def test_the_report_says_why_a_run_with_broken_truth_has_no_picture(tmp_path: Path, truth: bytes) -> None:
    def made(_row: object, number: int) -> Kept | None:
        return msgspec.structs.replace(kept(), moments=(moment(),)) if number else kept()

    bad = table("results", made)
    for run in (run for row in bad.rows for run in row.runs if run.kept):
        (tmp_path / run.key).mkdir(exist_ok=True)
        (tmp_path / run.key / "log.mcap").write_bytes(b"no log")
        (tmp_path / run.key / "truth.msgpack.gz").write_bytes(truth)
    about = report.about([bad], "drivemcp evaluate results", quick=True, latencies="fixed")
    text = report.html([bad], about, tmp_path, tmp_path)
    assert "No picture: " in text
    assert "log.mcap: " in text[text.index("No picture: ") :]
