"""Made-up numbers, units, road users and citations are counted, and controls show a model that heeds no scene."""

from pathlib import Path

import pytest

from evaluation.baselines.direct.cassette import Line, write
from evaluation.baselines.direct.template import Asked
from studies.made_up.__main__ import grouped, main
from studies.made_up.checks import abstains, made_up, numbers
from studies.made_up.controls import controls

SCENE = "The ego vehicle drives at 63 km/h.\nA vehicle is 20 m ahead in the path.\nThe traffic sign is a speed limit sign of 50 km/h."


def line(text: str, context: str = SCENE, passages: tuple[str, ...] = (), tools: tuple[str, ...] = ()) -> Line:
    query = "Which speed limit is in force here?"
    return Line(
        backend="b:1", prompt=text + context, text=text, context=context, query=query, passages=passages, tools=tools
    )


@pytest.mark.parametrize(
    ("text", "field", "count"),
    [
        ("Drive at most 50 km/h.", "numbers", (0, 1)),
        ("Drive at most 30 km/h.", "numbers", (1, 1)),
        ("Drive at most 50 mph.", "units", (1, 1)),
        ("Drive at most 50 km/h.", "units", (0, 1)),
        ("Drive at most 30 mph.", "units", (0, 1)),
        ("Slow down.", "numbers", (0, 0)),
        ("A vehicle is ahead in the path.", "actors", (0, 1)),
        ("A pedestrian is ahead in the path.", "actors", (1, 1)),
        ("The ego vehicle drives fast.", "actors", (0, 0)),
        ("By § 3 you may.", "citations", (1, 1)),
        ("Mind the bend.", "understood", (0, 1)),
        ("I do not know.", "understood", (1, 1)),
        ("I do not know.", "abstained", (1, 1)),
        ("Stop.", "understood", (1, 1)),
    ],
)
def test_an_answer_is_held_against_its_prompt(text: str, field: str, count: tuple[int, int]) -> None:
    assert tuple(getattr(made_up([line(text)]), field)) == count


def test_what_passages_and_tools_say_is_not_made_up() -> None:
    said = "By § 3 drive at most 100 km/h."
    assert made_up([line(said)]).numbers == (1, 1)
    told = made_up([line(said, tools=("The speed limit is 100 km/h.", "It is set by StVO § 3."))])
    assert (told.numbers, told.citations) == ((0, 1), (0, 1))


def test_numbers_are_read_with_their_units() -> None:
    assert numbers("at 0.81 km/h, 20 mph, 3 and 40m of § 12a") == {
        (0.81, "km/h"),
        (20.0, "mph"),
        (3.0, ""),
        (40.0, "m"),
    }
    assert abstains("") and abstains("I do not know") and not abstains("I do not know, 50")  # noqa: PT018


def test_a_model_that_heeds_no_scene_is_found_out_by_the_controls() -> None:
    other = SCENE.replace("50", "80")
    lines = [
        line("Drive at most 50 km/h."),
        line("Drive at most 80 km/h.", other),
        line("I do not know.", "The road is rural."),
    ]

    def heeds(asked: Asked) -> str:
        return next((each.text for each in lines if each.context == asked.context), "I do not know.")

    assert controls(lines, lambda _: "Drive at most 50 km/h.", 9) == ((1, 1), (1, 2))
    assert controls(lines, heeds, 9) == ((0, 1), (0, 2))


def test_the_study_shows_a_row_for_each_backend_and_kind_of_prompt(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line("Stop."), line("Stop.", tools=("t",)), line("Stop.", passages=("p",))]
    assert [key[1] for key in grouped(lines)] == ["scene alone", "with passages of law", "with tools"]
    write(file := tmp_path / "a.jsonl.gz", lines)
    assert main([str(file)]) == 0
    assert capsys.readouterr().out.count("| b:1 |") == 3
    assert main([str(tmp_path / "absent.jsonl")]) == 2


def test_controls_are_played_from_a_cassette_of_the_same_model_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(file := tmp_path / "a.jsonl", [Line(backend="gguf:free:tiny", prompt="x", text="Stop.", query="q")])
    write(empty := tmp_path / "controls.jsonl", [])
    assert main([str(file), "--controls", str(empty)]) == 2
    assert "has no answers of gguf:free:tiny" in capsys.readouterr().err
