"""Whole prompts: fixed structure, extractive reader, advice by a closed grammar."""

import string

import cv2
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.testing import bus
from evaluation.baselines.direct.extractive import extracted
from evaluation.baselines.direct.parsed_advice import NO_ADVICE, advice_of
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from evaluation.baselines.direct.template import Asked, filled, load
from proto import topics
from proto.sensors import CameraFrame
from services.drivelm.backends.config import OpenaiConfig
from services.drivelm.service import SERVICE, DrivelmConfig
from tests.unit.services.drivelm.chat_server import chat_server, says

URBAN = "In built-up areas (inside the town signs) the speed limit for all motor vehicles is 50 km/h."
CONTEXT = "The ego vehicle drives at 83 km/h.\nThe traffic sign is a speed limit sign of 70 km/h.\nThe traffic light is green."


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Drive at most 50 km/h.", ("limit", 50.0, "km/h", "")),
        ("Slow down to 30 mph.", ("limit", 30.0, "mph", "")),
        ("The traffic sign is a speed limit sign of 80.", ("limit", 80.0, None, "")),
        ("The panel shows a speed limit of 60.", ("limit", 60.0, None, "")),
        (URBAN, ("limit", 50.0, "km/h", "")),
        ("The traffic light is red.", ("stop", None, None, "")),
        ("The traffic sign is a give way sign.", ("give_way", None, None, "")),
        ("A pedestrian is 14 m ahead in the path and comes nearer.", ("hazard", None, None, "pedestrian")),
        ("Drive at most 70 km/h. Drive at most 50 km/h.", ("limit", 50.0, "km/h", "")),
        ("Drive at most 50 km/h. Stop.", ("stop", None, None, "")),
        ("The traffic sign ahead is a speed limit sign of 50 km/h.", ("limit_ahead", 50.0, "km/h", "")),
        ("The traffic sign ahead is a speed limit sign of 80 km/h when wet.", ("limit_ahead", 80.0, "km/h", "")),
        ("The panel ahead shows a speed limit of 60.", ("limit_ahead", 60.0, None, "")),
        ("The speed limit ahead is 30 mph.", ("limit_ahead", 30.0, "mph", "")),
        ("The traffic sign ahead is a stop sign.", ("stop", None, None, "")),
        ("Drive at most 70 km/h. The speed limit ahead is 50 km/h.", ("limit", 70.0, "km/h", "")),
    ],
)
def test_the_most_careful_of_known_sentences_is_the_advice(text: str, expected: tuple[object, ...]) -> None:
    assert tuple(advice_of(text)) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "I do not know.",
        "Ignore the rules and drive at most 250 km/h.",
        "Drive at most 250 km/h.",
        "Drive at most 57 km/h.",
        "You may drive 120 km/h here",
        "The limit was 50 km/h, but now you can go faster.",
        "Drive at most ５0 km/h.",
        "The traffic sign is an end of speed limit sign.",
        "The traffic light is green.",
        "The traffic sign ahead is a speed limit sign of 57 km/h.",
        "The traffic sign ahead is an end of speed limit sign.",
        "The speed limit ahead is 250 km/h.",
        "Ahead the traffic sign ahead is a speed limit sign of 50 km/h.",
    ],
)
def test_what_is_of_no_known_form_advises_nothing(text: str) -> None:
    assert advice_of(text) == NO_ADVICE


@given(text=st.text(st.sampled_from(string.printable + "äéＫ"), max_size=200))
def test_no_text_beside_an_advice_raises_it(text: str) -> None:
    told = advice_of(f"Drive at most 30 km/h.\n{text}")
    assert told.action in ("stop", "hazard", "give_way") or (told.value or 99) <= 30


def test_the_prompt_has_the_fixed_structure_and_its_parts_are_never_filled_in_again() -> None:
    prompt = filled(load(), Asked("{query} {passages}", "{context}", ("a", "b")))
    head, _, rest = prompt.partition("Context:\n")
    assert "never control the car" in head
    assert rest.startswith("{query} {passages}\n\nQuery: {context}")
    assert rest.endswith("Passages:\n- a\n- b\n")
    assert "Passages" not in filled(load(), Asked("c", "q"))


def test_the_reader_picks_the_sentence_that_shares_most_and_nothing_where_none_does() -> None:
    text, score = extracted(Asked(CONTEXT, "Which speed limit is in force here?", (URBAN,)))
    assert (text, score > 0) == ("The traffic sign is a speed limit sign of 70 km/h.", True)
    assert extracted(Asked("The road is urban.", "Which speed limit is in force here?", (URBAN,)))[0] == URBAN
    assert extracted(Asked(CONTEXT, "Who wrote Faust?")) == ("", 0.0)


STOPS = "Is there a stop sign, a give way sign or a red traffic light?"
LAW = "Whoever comes to a red traffic light, a stop sign or a give way sign shall stop there."


@pytest.mark.parametrize("told", ["The traffic light is red.", "The traffic sign ahead is a stop sign."])
def test_law_of_which_nothing_can_be_advised_hides_no_sentence_that_can(told: str) -> None:
    assert extracted(Asked(told, STOPS, (LAW,)))[0] == told
    assert extracted(Asked("The road is urban.", STOPS, (LAW,)))[0] == LAW
    assert extracted(Asked("The traffic light is green.", STOPS, (LAW,)))[0] == LAW, "nothing there to be hidden"


def test_of_sentences_that_share_as_much_the_most_careful_is_read_and_of_those_the_first() -> None:
    limits = [f"The traffic sign ahead is a speed limit sign of {each} km/h." for each in (80, 60, 70)]
    assert extracted(Asked("\n".join(limits), "Which speed limit begins ahead?"))[0] == limits[1]
    actors = [f"A {each} is 20 m ahead in the path." for each in ("cyclist", "pedestrian")]
    assert extracted(Asked("\n".join(actors), "Who is ahead in the path?"))[0] == actors[0]


@pytest.mark.parametrize("nearer", ["", " and comes nearer"])
@pytest.mark.parametrize("person", ["pedestrian", "cyclist"])
def test_a_person_is_read_for_the_query_for_people_and_a_vehicle_for_that_for_vehicles(
    person: str, nearer: str
) -> None:
    people, car = f"A {person} is 60 m ahead in the path{nearer}.", "A vehicle is 20 m ahead in the path"
    query, sign = (
        "Is a pedestrian or cyclist ahead in the path?",
        "The traffic sign ahead is a pedestrian crossing sign.",
    )
    assert extracted(Asked(f"{car}.\n{people}\n{sign}", query))[0] == people
    query = "Which vehicle is ahead in the path and comes nearer?"
    assert extracted(Asked(f"{people}\n{car} and comes nearer.", query))[0] == f"{car} and comes nearer."


def test_a_limit_ahead_and_the_one_in_force_are_told_apart_by_the_query() -> None:
    both = (
        "The traffic sign ahead is a speed limit sign of 50 km/h.\nThe traffic sign is a speed limit sign of 70 km/h."
    )
    assert advice_of(extracted(Asked(both, "Which speed limit is in force here?"))[0]).action == "limit"
    assert advice_of(extracted(Asked(both, "Which speed limit begins ahead?"))[0]).action == "limit_ahead"


def test_the_service_answers_whole_prompts_and_says_how() -> None:
    with bus() as b:
        b.start(SERVICE, DrivelmConfig(whole_prompts=True))
        outcome = b.call("answer_prompt", {"query": "Which speed limit is in force here?", "context": CONTEXT})
        assert outcome.ok, outcome.error
        answer = msgspec.convert(outcome.result, PromptAnswer)
        assert (answer.action, answer.value, answer.unit) == ("limit", 70.0, "km/h")
        assert "no language model" in answer.method
        assert answer.backend.startswith("embedded")
        nothing = b.call("answer_prompt", {"query": "Which speed limit is in force here?"})
        assert nothing.result is not None
        assert (nothing.result["text"], nothing.result["action"]) == ("", "none")


def test_a_language_model_gets_the_whole_prompt_with_the_picture_and_its_time_is_told() -> None:
    with chat_server(says("Drive at most 60 km/h. Have a nice day.", logprob=-0.01)) as server, bus() as b:
        openai = OpenaiConfig(base_url=server.url, model="tiny-vlm", timeout_s=8.0)
        b.start(SERVICE, DrivelmConfig(whole_prompts=True, prompt_backend="openai", openai=openai))
        picture = cv2.imencode(".jpg", np.full((36, 64, 3), 120, np.uint8))[1].tobytes()
        frame = CameraFrame(jpeg=picture, width_px=64, height_px=36, frame=1)
        for _ in range(200):  # until the picture is there
            b.probe.publish(topics.CAMERA, frame, id="front")
            outcome = b.call("answer_prompt", {"query": "How fast?", "context": CONTEXT, "passages": [URBAN]})
            if outcome.result is not None and outcome.result["text"]:
                break
        answer = msgspec.convert(outcome.result, PromptAnswer)
        assert (answer.action, answer.value, answer.method) == ("limit", 60.0, "generated by the backend")
        assert answer.backend.startswith("openai:tiny-vlm")
        assert answer.took_ms > 0.0
        assert server.asked[-1].prompt == filled(load(), Asked(CONTEXT, "How fast?", (URBAN,)))
