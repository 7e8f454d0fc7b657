"""What the command line refuses, before anything is driven."""

import argparse
from contextlib import nullcontext
from pathlib import Path

import pytest

from drivemcp.cli import run
from evaluation.baselines.direct.cassette import Line, write
from evaluation.evaluate.asked import recorded_otherwise
from evaluation.run.behaviour import behaviour


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (
            ("results", "--method", "Nothing"),
            "--method: there is no method 'Nothing'; there are DriveMCP, No CAN context, ",
        ),
        (("results", "--km-of", "No tracking=5"), "--km-of: there is no method 'No tracking'"),
        (("results", "--method", "No tracking"), "--method: the table results has no row of No tracking"),
        (("results", "--runs-of", "nothing=3"), "--runs-of: TABLE=N with TABLE one of results, corruption, "),
        (("results", "--runs-of", "corruption=0"), "--runs-of: "),
        (("delta", "--runs-of", "corruption=8"), "--runs-of corruption: only delta was asked for"),
        (("delta", "--km-of", "DriveMCP=8"), "--km-of: only the table results has it, and delta was asked for"),
        (("results", "--quick", "--km", "8"), "--quick drives 5 s a run: --km, --runs-of and --km-of have no place"),
        (("results", "--set", "arbitr.delta=0.3"), "no service 'arbitr'; there are arbiter, "),
        (
            ("delta", "--set", "arbiter.delta=0.3"),
            "--set arbiter.delta: it makes the row '0' of the table delta what it is",
        ),
        (
            ("results", "--method", "DriveMCP", "--set", "arbiter.filter=none"),
            "--set arbiter.filter: it makes the row 'VLM-Tools-NoArbiter' of the table results what it is",
        ),
        (("results", "--set", "arbiter.detla=0.3"), "--set arbiter: Object contains unknown field `detla`"),
        (
            ("results", "--set", "arbiter.delta=much"),
            "--set arbiter: Expected `float | null`, got `str` - at `$.delta`",
        ),
        (
            ("results", "--set", 'arbiter.delta="0.2"'),
            "--set arbiter: Expected `float | null`, got `str` - at `$.delta`",
        ),
        (("results", "--set", "gateway.port=1"), "--set gateway: no run starts that service"),
        (("results", "--method", "VLM-Direct", "--km-of", "DriveMCP=30"), "--km-of DriveMCP: --method leaves its rows"),
        (("all", "--method", "VLM-Direct", "--runs-of", "corruption=8"), "--runs-of corruption: that table has no row"),
        (("results", "--quick", "--jobs", "3", "--ray", "local"), "--jobs: beside --ray the cluster says how many"),
        (("results", "--set", "drivelm.backend=openai"), "--set drivelm.backend: runs are in lockstep"),
        (("can-fault", "--set", "simulator.faults=[]"), "--set simulator.faults: it makes the row "),
        (("results", "--quick", "--again", "0123"), "--again is about runs of --published; name the file"),
        (("results", "--quick", "--publish", "."), "--publish .: is a folder; name a file in it"),
        (("results", "--quick", "--publish", f"{__file__}/x.jsonl"), "/x.jsonl: File exists; name a file that can be"),
        (("results", "--record-answers", "a.jsonl", "--answers", "b.jsonl"), "a run records its answers or plays them"),
        (("results", "--answers", "absent.jsonl"), "cassette absent.jsonl: No such file or directory"),
        (("guard", "--answers", "a.jsonl"), "no row of the table guard answers prompts"),
        (("results", "--ray", "local", "--record-answers", "a.jsonl"), "--record-answers: beside --ray"),
        (
            ("results", "--language-model", "openai"),
            "--language-model: the table results has none; the table proposer has",
        ),
        (
            ("proposer", "--set", "drivelm.gguf.decoding=free"),
            "--set drivelm.gguf.decoding: it makes the row 'LM-Direct, free'",
        ),
        (("proposer", "--set", "drivelm.gguf.threads=0"), "--set drivelm: Expected `int` >= 1 - at `$.gguf.threads`"),
        (("results", "--set", "arbiter.profile=nosuch"), "--set arbiter.profile nosuch: No such file or directory; "),
    ],
)
def test_what_is_asked_wrongly_is_named(
    asked: tuple[str, ...], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) if {"nothing=3", "corruption=0"} & {*asked} else nullcontext():
        assert run(["evaluate", *asked, "--out", str(tmp_path)]) == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.glob("runs/*/metrics.json"))


def test_a_place_that_cannot_be_written_to_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (file := tmp_path / "file").touch()
    assert run(["evaluate", "delta", "--quick", "--out", str(file)]) == 2
    assert f"runs cannot go into {file}/runs: Not a directory" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("at", "told"), [("0" * 12, True), (behaviour(), False), ("", False)], ids=["other", "same", "not noted"]
)
def test_answers_that_were_recorded_at_another_behaviour_are_said_to_be_before_anything_is_driven(
    tmp_path: Path, at: str, told: bool
) -> None:
    write(file := tmp_path / "answers.jsonl", [Line(backend="b", prompt="x")], at)
    note = recorded_otherwise(argparse.Namespace(answers=str(file)))
    assert (f"was recorded at behaviour {at}, and today's is {behaviour()}" in note) == told
    assert bool(note) == told


def test_a_cassette_without_answers_of_a_rows_backend_is_refused_before_anything_is_driven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(file := tmp_path / "answers.jsonl", [Line(backend="gguf:free:some", prompt="x")])
    asked = ["proposer", "--quick", "--method", "LM-Direct, forms", "--answers", str(file), "--out", str(tmp_path)]
    assert run(["evaluate", *asked]) == 2
    assert "it has no answers of gguf:forms, by which LM-Direct, forms is driven" in capsys.readouterr().err
