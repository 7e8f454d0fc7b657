"""DriveLM's files come in and go out as the same value; what is no such file is refused by the field that is wrong."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import QA, SceneGraph, SceneObject
from studies.gvqa.drivelm_json import Scene, UnreadableGraph, from_drivelm, to_drivelm
from studies.gvqa.files import load
from tests.shared import SHARED

ANNOTATED = SHARED / "data" / "street" / "sequence" / "gvqa.json"
needs_annotation = pytest.mark.skipif(
    not ANNOTATED.is_file(), reason="the annotated sequence lies outside the project and is absent here"
)

WORDS = st.text(max_size=12)
PIXELS = st.floats(-1e5, 1e5)
OBJECTS = st.builds(
    SceneObject, tag=WORDS, category=WORDS, status=WORDS, description=WORDS, box_px=st.tuples(*[PIXELS] * 4)
)
QUESTIONS = st.builds(
    QA,
    layer=st.sampled_from(("perception", "prediction", "planning", "behavior")),
    question=WORDS,
    answer=WORDS,
    score=st.floats(0, 1),
    parents=st.lists(st.integers(0, 5), max_size=3).map(tuple),
)
GRAPHS = st.builds(
    SceneGraph,
    camera=st.sampled_from(("front", "tele", "rear")),
    frame=st.integers(0, 10_000),
    objects=st.lists(OBJECTS, max_size=4).map(tuple),
    qa=st.lists(QUESTIONS, max_size=6).map(tuple),
)
ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False, allow_infinity=False) | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3),
    max_leaves=6,
)


def _document() -> dict[str, Any]:
    row = {
        "Q": "Is it?",
        "A": "Yes.",
        "C": None,
        "con_up": [0],
        "con_down": ["x"],
        "cluster": 3,
        "layer": 2,
        "tag": [0],
    }
    shown = {
        "Category": "Vehicle",
        "Status": None,
        "Visual_description": "",
        "2d_bbox": [0, 1.5, 2, 3],
        "colour": "red",
    }
    frame = {
        "image_paths": {"CAM_BACK": "b.jpg"},
        "QA": {"behavior": [row], "perception": [], "mood": [{"any": 1}]},
        "key_object_infos": {"<c1,CAM_BACK,1.0,2.0>": shown},
        "weather": {"rain": True},
    }
    return {"scene": {"licence": "x", "scene_description": "A road.", "key_frames": {"one": frame}}}


@needs_annotation
def test_an_annotated_sequence_goes_out_byte_for_byte_as_it_came_in() -> None:
    text = ANNOTATED.read_bytes()
    out = to_drivelm(from_drivelm(load(ANNOTATED)))
    assert out == json.loads(text)
    assert json.dumps(out, indent=0).encode() == text.strip()


@needs_annotation
def test_an_annotated_sequence_is_read_whole() -> None:
    graphs = list(next(iter(from_drivelm(load(ANNOTATED)).values())).frames.values())
    assert [len(graph.qa) for graph in graphs] == [104, 99, 100, 84, 92]
    assert graphs[0].objects[0].tag.startswith("<c1,CAM_FRONT")
    assert graphs[0].objects[0].box_px == (624.3, 469.4, 814.8, 537.8)


def test_unknown_fields_layers_and_nothings_are_carried_in_their_order() -> None:
    document = _document()
    out = to_drivelm(from_drivelm(document))
    assert json.dumps(out) == json.dumps(document).replace("[0, 1.5, 2, 3]", "[0.0, 1.5, 2.0, 3.0]")


@given(GRAPHS)
def test_any_graph_exported_imported_and_exported_is_the_same(graph: SceneGraph) -> None:
    first = to_drivelm({"drive": Scene("A road.", {"0001": graph})})
    assert to_drivelm(from_drivelm(json.loads(json.dumps(first)))) == first


@given(st.dictionaries(WORDS, ANY_JSON, max_size=3))
def test_any_further_field_survives_at_every_level(more: dict[str, Any]) -> None:
    document = _document()
    scene = document["scene"]
    frame = scene["key_frames"]["one"]
    for level in (scene, frame, frame["QA"]["behavior"][0], next(iter(frame["key_object_infos"].values()))):
        level.update({key: value for key, value in more.items() if key not in level})
    assert to_drivelm(from_drivelm(document)) == document


def test_parents_point_at_the_questions_where_the_file_has_them() -> None:
    late = QA(layer="perception", question="first?", answer="a", score=1.0)
    early = QA(layer="planning", question="second?", answer="b", score=1.0, parents=(1,))
    out = to_drivelm({"drive": Scene("", {"k": SceneGraph(camera="front", frame=0, objects=(), qa=(early, late))})})
    questions = out["drive"]["key_frames"]["k"]["QA"]
    assert questions["perception"][0]["Q"] == "first?"
    assert questions["planning"][0]["con_up"] == [0]


def test_an_edited_answer_goes_out_edited() -> None:
    scene = from_drivelm(_document())["scene"]
    graph = scene.frames["one"]
    edited = SceneGraph(
        camera=graph.camera,
        frame=graph.frame,
        objects=graph.objects,
        qa=(QA(layer="behavior", question="Is it?", answer="No.", score=0.5, carried=graph.qa[0].carried),),
        carried=graph.carried,
    )
    out = to_drivelm({"scene": scene._replace(frames={"one": edited})})
    assert out["scene"]["key_frames"]["one"]["QA"]["behavior"] == [
        _document()["scene"]["key_frames"]["one"]["QA"]["behavior"][0] | {"A": "No."}
    ]


REFUSED: list[tuple[tuple[str | int, ...], Any, str]] = [
    (("scene",), 3, "scene: expected an object, found a number"),
    (("scene", "key_frames"), [], "scene.key_frames: expected an object, found a list"),
    (("scene", "scene_description"), None, "scene.scene_description: expected text, found null"),
    (("scene", "key_frames", "one", "QA", "behavior"), {}, r"one.QA.behavior: expected a list"),
    (("scene", "key_frames", "one", "QA", "behavior", 0), "x", r"QA.behavior\[0\]: expected an object, found text"),
    (("scene", "key_frames", "one", "QA", "behavior", 0, "A"), 4, r"QA.behavior\[0\].A: expected text"),
    (("scene", "key_frames", "one", "key_object_infos", "<c1,CAM_BACK,1.0,2.0>", "2d_bbox"), [1, 2, 3], "2d_bbox"),
    (("scene", "key_frames", "one", "key_object_infos", "<c1,CAM_BACK,1.0,2.0>", "2d_bbox"), [1, 2, 3, True], "2d_bbox"),
    (("scene", "key_frames", "one", "key_object_infos", "<c1,CAM_BACK,1.0,2.0>", "2d_bbox"), [1, 2, 3, 1e300], "2d_b"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "told"), REFUSED)
def test_a_malformed_file_is_refused_by_its_field(path: tuple[str | int, ...], value: Any, told: str) -> None:
    document: Any = _document()
    inner = document
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = value
    with pytest.raises(UnreadableGraph, match=told):
        from_drivelm(document)


@pytest.mark.parametrize("name", ["scene_description", "key_frames"])
def test_an_absent_field_is_named(name: str) -> None:
    document = _document()
    del document["scene"][name]
    with pytest.raises(UnreadableGraph, match=f"scene.{name}: absent"):
        from_drivelm(document)


@pytest.mark.parametrize("text", [b"", b"\xff", b'{"\xff": 1}', b"[1]", b'{"a": NaN}', b"[" * 100_000])
def test_what_is_no_json_object_is_refused(text: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(text)
    with pytest.raises(UnreadableGraph):
        from_drivelm(load(tmp_path / "a.json"))


@given(ANY_JSON)
def test_whatever_stands_in_a_file_is_read_or_refused(document: Any) -> None:
    try:
        scenes = from_drivelm(document)
    except UnreadableGraph as error:
        scenes, document = {}, {"told in one line": str(error).splitlines()} if "\n" in str(error) else {}
    assert to_drivelm(scenes) == document
