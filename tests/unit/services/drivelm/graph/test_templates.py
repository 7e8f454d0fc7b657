"""Questions in DriveLM's forms: each is recognised, answered of its objects alone, and left where the graph does not know."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.perception import Box, Track
from proto.scene import Fact, SceneGraph
from proto.vehicle import Ego
from services.drivelm.graph.answering import COUNTED, EXTRACTED, IN_FORM, SILENT, ask
from services.drivelm.graph.scene_graph import Seen, build
from services.drivelm.graph.templates import FORMS, SIDES, UNANSWERED, recognise
from studies.gvqa.drivelm_json import from_drivelm
from studies.gvqa.files import load
from tests.shared import SHARED

ANNOTATED = SHARED / "data" / "street" / "sequence" / "gvqa.json"
CAR, LIMIT, LIGHT = "<c1,CAM_FRONT,330.0,200.0>", "<c2,CAM_FRONT,412.5,132.5>", "<c3,CAM_FRONT,207.5,118.0>"
WORDS = {"{kind}": "cars", "{motion}": "moving ", "{be}": "are", "{will}": "Would", "*": " And more?"}


def _box(track_id: int, kind: str, x: float, y: float) -> Box:
    return Box(x0_px=x - 5, y0_px=y - 5, x1_px=x + 5, y1_px=y + 5, kind=kind, score=0.9, track_id=track_id)  # type: ignore[arg-type]


def _track(track_id: int = 1, **other: object) -> Track:
    plain = {"x_m": 22.0, "y_m": 0.1, "vx_mps": -8.0, "vy_mps": 0.0, "confidence": 0.93, "in_ego_path": True}
    return Track(track_id=track_id, kind="vehicle", **{**plain, **other})  # type: ignore[arg-type]


def _fact(track_id: int, reading: str, **other: object) -> Fact:
    kind = reading.split(":")[0]
    plain = {"kind": kind, "confidence": 0.98, "frame_stamp_ns": 1, "sentence": f"It is {reading}."}
    return Fact(track_id=track_id, reading=reading, **{**plain, **other})  # type: ignore[arg-type]


def _graph(*tracks: Track, facts: tuple[Fact, ...] = (), speed_mps: float | None = 14.0) -> SceneGraph:
    boxes = [_box(track.track_id, "vehicle", 330 + 40 * (track.track_id - 1), 200) for track in tracks]
    places = {"limit": (412.5, 132.5), "light": (207.5, 118.0)}
    boxes += [_box(fact.track_id, "light" if fact.kind == "light" else "sign", *places[fact.kind]) for fact in facts]
    ego = Ego(speed_mps=speed_mps, yaw_rate_radps=0.0)
    return build(Seen(camera="front", frame=0, boxes=boxes, tracks=tracks, facts=facts, ego=ego))


ROAD = _graph(
    _track(),
    facts=(_fact(2, "limit:80", value=80, unit="km/h", distance_m=35.0), _fact(3, "light:red", distance_m=48.0)),
)


def _filled(form: str) -> str:
    for hole, word in {**WORDS, "{tag}": CAR, "{side}": "front left"}.items():
        form = form.replace(hole, word)
    return form


@pytest.mark.parametrize("family", [*FORMS, *UNANSWERED])
def test_every_form_is_recognised_as_its_own_family(family: str) -> None:
    form = {**FORMS, **UNANSWERED}[family][1]
    asked = recognise(_filled(form))
    assert asked is not None
    assert asked.family == family
    assert len(asked.tags) == form.count("{tag}")


@given(st.sampled_from(sorted(FORMS)), st.sampled_from([" ", "  ", "\t"]), st.booleans())
def test_spaces_and_capitals_do_not_matter(family: str, space: str, upper: bool) -> None:
    question = _filled(FORMS[family][1]).replace(" ", space)
    asked = recognise(question.upper() if upper else question)
    assert asked is not None
    assert asked.family == family


def test_the_graph_asks_in_forms_that_it_recognises() -> None:
    assert all(recognise(qa.question) is not None for qa in ROAD.qa)


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        (f"What is the moving status of object {CAR}?", "Going ahead."),
        (f"What is the observed status of object {CAR}?", "Moving."),
        (f"Would {CAR} be in the moving direction of the ego vehicle?", "Yes."),
        (f"What is the future state of {CAR}?", "Keep going straight."),
        (f"What kind of traffic sign is {LIGHT}?", "Traffic light."),
        (f"What does {LIMIT} mean?", "The traffic sign is a speed limit sign of 80."),
        (f"Are {LIMIT} and {CAR} traffic signs?", "Only one of the boxes is a traffic sign."),
        (f"Based on {LIGHT} in this scene, what is the most possible action of the ego vehicle?", "Brake gently to a stop."),
        (f"What actions taken by the ego vehicle can lead to a collision with {CAR}?", "Accelerating and going straight."),
        ("In this scenario, what are safe actions to take for the ego vehicle?", "Brake gently to a stop, slow down."),
        ("In this scenario, what are dangerous actions to take for the ego vehicle?", "Accelerate and go ahead, back up."),
        ("What is the target action of the ego vehicle?", "Stationary."),
        ("Are there moving cars to the front of the ego car?", "Yes."),
        ("Are there parked cars to the front of the ego car?", "No."),
        ("Are there cars to the front left of the ego car?", "No."),
        ("What is the status of the car that is to the front of the ego car?", "One car is moving."),
        ("What are objects to the front of the ego car?", "There is one vehicle in front of the ego car."),
        ("Predict the behavior of the ego vehicle.", "The ego vehicle is going straight. The ego vehicle is driving with normal speed."),
    ],
)  # fmt: skip
def test_a_form_is_answered_from_the_graph(question: str, answer: str) -> None:
    found = ask(ROAD, question)
    assert found.text == answer
    assert 0 < found.score <= 1


@pytest.mark.parametrize(
    "question",
    [
        f"Which object is most likely to be occluded by {CAR}?",
        f"Would {CAR} take {LIGHT} into account?",
        f"What is the moving status of object {LIGHT}?",  # a light does not move about
        "What is the moving status of object <c1,CAM_BACK,330.0,200.0>?",  # another camera
        "What is the moving status of object <c1,CAM_FRONT,346.0,200.0>?",  # 16 px off: another object
        "Are there trucks to the front of the ego car?",  # a vehicle's make is not known
        "Are there traffic cones to the front of the ego car?",  # never detected
        "Are there cars to the back of the ego car?",  # nobody looked there
        "What are objects to the back left of the ego car?",
        "What are objects to the front left of the ego car?",  # none was found, which is not that there is none
    ],
)
def test_what_the_graph_does_not_know_is_left(question: str) -> None:
    found = ask(ROAD, question)
    assert (found.text, found.score) == (SILENT, 0.0)


def test_how_an_answer_was_found_is_told() -> None:
    assert ask(ROAD, f"What does {LIMIT} mean?").method == IN_FORM
    assert ask(ROAD, "Are there moving cars to the front of the ego car?").method == COUNTED
    assert ask(ROAD, "How fast is allowed here?").method == EXTRACTED


def test_an_object_is_known_by_its_place_within_16_px() -> None:
    assert ask(ROAD, "What is the moving status of object <c9,CAM_FRONT,337.0,208.0>?").text == "Going ahead."


@pytest.mark.parametrize("family", sorted(FORMS))
def test_of_a_graph_with_nothing_in_it_only_the_egos_behavior_is_known(family: str) -> None:
    found = ask(_graph(), _filled(FORMS[family][1]))
    assert (found.score > 0) == (family == "behavior")


def test_without_the_egos_speed_nobody_is_said_to_move() -> None:
    graph = _graph(_track(), speed_mps=None)
    assert ask(graph, f"What is the observed status of object {CAR}?").score == 0
    assert ask(graph, "Are there moving cars to the front of the ego car?").score == 0


def test_a_standing_vehicle_has_stopped_and_is_not_said_to_be_parked() -> None:
    graph = _graph(_track(vx_mps=-14.0))
    assert ask(graph, f"What is the moving status of object {CAR}?").text == "Stopped."
    assert ask(graph, "Are there moving cars to the front of the ego car?").text == "No."
    assert ask(graph, "Are there parked cars to the front of the ego car?").text == SILENT


def test_a_sign_that_is_not_believed_has_no_meaning_and_asks_for_less_speed() -> None:
    graph = _graph(facts=(_fact(2, "limit:80", believed=False, confidence=0.6),))
    tag = graph.objects[0].tag
    assert ask(graph, f"What does {tag} mean?").text == SILENT
    assert ask(graph, "What is the target action of the ego vehicle?").text == "Slow down."


def test_a_light_that_is_found_and_not_read_is_told_and_asks_for_less_speed() -> None:
    graph = build(Seen(camera="front", frame=0, boxes=[_box(3, "light", 207.5, 118.0)], ego=Ego(speed_mps=14.0)))
    assert ask(graph, "Is there any traffic element in the front view?").text.startswith("Yes")
    asked = "What is the traffic signal that the ego vehicle should pay attention to?"
    assert ask(graph, asked).text == "Traffic light that is not read with certainty."
    assert ask(graph, "What is the target action of the ego vehicle?").text == "Slow down."


def test_no_light_in_sight_is_not_said_to_be_no_light() -> None:
    assert (
        ask(_graph(_track()), "What is the traffic signal that the ego vehicle should pay attention to?").text == SILENT
    )


def test_another_cameras_sign_of_the_same_number_is_another_sign() -> None:
    graph = _graph(facts=(_fact(2, "limit:80", camera="tele"),))
    assert graph.objects[0].description == "Traffic sign that is not read with certainty."


TRACKS = st.lists(
    st.builds(
        lambda x_m, y_m, vx_mps, vy_mps, way: {"x_m": x_m, "y_m": y_m, "vx_mps": vx_mps, "vy_mps": vy_mps, "in_ego_path": way},
        st.floats(1, 120), st.floats(-12, 12), st.floats(-30, 10), st.floats(-6, 6), st.booleans(),
    ),
    max_size=4,
)  # fmt: skip
READINGS = st.lists(st.sampled_from(["limit:80", "light:red", "light:green"]), max_size=1)


@given(TRACKS, READINGS, st.none() | st.floats(0, 40))
def test_a_change_of_lane_is_never_said_to_be_safe(
    tracks: list[dict[str, float]], readings: list[str], speed_mps: float | None
) -> None:
    facts = tuple(_fact(9, reading, value=80.0) for reading in readings)
    graph = _graph(*(_track(n, **one) for n, one in enumerate(tracks, 1)), facts=facts, speed_mps=speed_mps)
    safe = ask(graph, "In this scenario, what are safe actions to take for the ego vehicle?")
    assert not any(word in safe.text.lower() for word in ("change", "offset", "turn", "accelerate"))
    if "light:red" in readings:
        assert safe.text in ("Brake gently to a stop, slow down.", "Remain stationary.")


@given(
    st.floats(1, 120),
    st.floats(0.2, 1),
    st.floats(-30, -1),
    st.floats(1, 3),
    st.sampled_from(["risk_braking", "risk_going_on"]),
)
def test_nearer_and_faster_is_never_less_probable_to_collide(
    x_m: float, nearer: float, vx_mps: float, faster: float, family: str
) -> None:
    question = FORMS[family][1].replace("{tag}", CAR)
    far = ask(_graph(_track(x_m=x_m, vx_mps=vx_mps)), question).text
    near = ask(_graph(_track(x_m=x_m * nearer, vx_mps=vx_mps * faster)), question).text
    ranks = ["Low.", "Medium.", "High."]
    assert ranks.index(near) >= ranks.index(far)


@pytest.mark.parametrize(("x_m", "risk"), [(11.3, "High."), (11.5, "Low.")])
def test_braking_helps_where_the_closing_speed_is_gone_before_the_gap(x_m: float, risk: str) -> None:
    # 8 m/s closing, 3.5 m/s2: 8 * 8 / 7 = 9.14 m; from the middle of a car of 4.5 m: 9.14 + 2.25 = 11.39 m
    question = FORMS["risk_braking"][1].replace("{tag}", CAR)
    assert ask(_graph(_track(x_m=x_m)), question).text == risk


@given(st.text(max_size=80), st.sampled_from(sorted(FORMS)))
def test_nothing_of_a_question_comes_back_in_an_answer(text: str, family: str) -> None:
    question = FORMS[family][1].replace("{tag}", CAR).replace("*", f" {text} limit of 987") + text
    found = ask(ROAD, question)
    assert "987" not in found.text


def test_every_side_of_a_question_is_one_side() -> None:
    for side in SIDES:
        asked = recognise(f"What are objects to the {side} of the ego car?")
        assert asked is not None
        assert asked.words == (side,)


@pytest.mark.skipif(
    not ANNOTATED.is_file(), reason="the annotated sequence lies outside the project and is absent here"
)
def test_every_question_of_an_annotated_sequence_is_recognised() -> None:
    graphs = [graph for scene in from_drivelm(load(ANNOTATED)).values() for graph in scene.frames.values()]
    assert json.dumps([qa.question for graph in graphs for qa in graph.qa if recognise(qa.question) is None]) == "[]"
