"""DriveLM's own file format, in and out: scenes of key frames with objects and questions by layer.

What a file holds beside the graph (``C``, ``con_down``, ``cluster``, picture paths, fields we do not know) travels in
``carried``: the file's own JSON object, with what the graph itself says put back into its places on the way out.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from proto.scene import QA, SceneGraph, SceneObject
from services.drivelm.graph.nodes import CAMERA_TAGS, side_of_tag
from services.drivelm.graph.templates import LAYERS
from studies.gvqa.json_fields import UnreadableGraph, as_box, as_list, as_object, as_text, field

__all__ = ["Scene", "UnreadableGraph", "from_drivelm", "to_drivelm"]

CAMERAS: Mapping[str, str] = {tag: camera for camera, tag in CAMERA_TAGS.items()}
# What DriveLM writes for what we do not know, in DriveLM's order.
_SCENE: dict[str, Any] = {"scene_description": None, "key_frames": None}
_FRAME: dict[str, Any] = {"key_object_infos": None, "QA": dict.fromkeys(LAYERS), "image_paths": None}
_MAY_BE_NULL = ("Status", "Visual_description")
_OBJECT: dict[str, Any] = {"Category": None, "Status": None, "Visual_description": "", "2d_bbox": None}
_QUESTION: dict[str, Any] = dict.fromkeys(("Q", "A", "C", "con_up", "con_down", "cluster", "layer"))


class Scene(NamedTuple):
    """A drive's graphs by the key of their frame (a stamp, or DriveLM's own key), and what the file says beside them."""

    description: str
    frames: Mapping[str, SceneGraph]
    carried: Mapping[str, Any] = {}


def to_drivelm(scenes: Mapping[str, Scene]) -> dict[str, Any]:
    """Scenes in DriveLM's form. What came from such a file goes out as the same JSON value."""
    return {name: _scene_out(scene) for name, scene in scenes.items()}


def _scene_out(scene: Scene) -> dict[str, Any]:
    frames = {key: _frame_out(graph) for key, graph in scene.frames.items()}
    return {**(scene.carried or _SCENE), "scene_description": scene.description, "key_frames": frames}


def _frame_out(graph: SceneGraph) -> dict[str, Any]:
    said = graph.carried or _FRAME | {"image_paths": {_tag(graph.camera): f"frame-{graph.frame}.jpg"}}
    objects = {shown.tag: _object_out(shown) for shown in graph.objects}
    return {**said, "key_object_infos": objects, "QA": _questions_out(graph, said["QA"])}


def _tag(camera: str) -> str:
    return CAMERA_TAGS.get(camera, f"CAM_{camera.upper()}")


def _object_out(shown: SceneObject) -> dict[str, Any]:
    said = shown.carried or _OBJECT
    return {
        **said,
        "Category": shown.category,
        "Status": shown.status or said["Status"],
        "Visual_description": shown.description or said["Visual_description"],
        "2d_bbox": list(shown.box_px),
    }


def _questions_out(graph: SceneGraph, said: Mapping[str, Any]) -> dict[str, Any]:
    order = sorted(range(len(graph.qa)), key=lambda index: LAYERS.index(graph.qa[index].layer))
    moved = {index: place for place, index in enumerate(order)}
    rows: dict[str, list[dict[str, Any]]] = {layer: [] for layer in LAYERS}
    for index in order:
        rows[graph.qa[index].layer].append(_question_out(graph.qa[index], moved))
    asked = {layer: found for layer, found in rows.items() if found or layer in said}
    return {**said, **asked}


def _question_out(qa: QA, moved: Mapping[int, int]) -> dict[str, Any]:
    parents = [moved[parent] for parent in qa.parents if parent in moved] or None
    said = qa.carried or _QUESTION | {"con_up": parents}
    return {**said, "Q": qa.question, "A": qa.answer}


def from_drivelm(document: Any) -> dict[str, Scene]:
    """Scenes of a DriveLM file. Annotations carry no score: theirs is 1. Raises ``UnreadableGraph`` naming the field."""
    return {name: _scene_in(as_object(body, name), name) for name, body in as_object(document, "the file").items()}


def _scene_in(body: Mapping[str, Any], where: str) -> Scene:
    description = as_text(*field(body, "scene_description", where))
    frames, place = field(body, "key_frames", where)
    rows = as_object(frames, place).items()
    graphs = {
        key: _frame_in(as_object(frame, f"{place}.{key}"), f"{place}.{key}", number, description)
        for number, (key, frame) in enumerate(rows)
    }
    return Scene(description, graphs, {**body, "key_frames": None})


def _frame_in(frame: Mapping[str, Any], where: str, number: int, description: str) -> SceneGraph:
    objects, place = field(frame, "key_object_infos", where)
    questions, asked = field(frame, "QA", where)
    pictures = frame.get("image_paths")
    first = next(iter(pictures), "CAM_FRONT") if isinstance(pictures, dict) else "CAM_FRONT"
    return SceneGraph(
        camera=CAMERAS.get(first, "front"),
        frame=number,
        objects=tuple(_object_in(tag, row, f"{place}.{tag}") for tag, row in as_object(objects, place).items()),
        qa=_questions_in(as_object(questions, asked), asked),
        description=description,
        backend="annotation",
        carried={**frame, "key_object_infos": None, "QA": {**questions, **dict.fromkeys(_known(questions))}},
    )


def _known(questions: Mapping[str, Any]) -> list[str]:
    return [layer for layer in questions if layer in LAYERS]


def _object_in(tag: str, value: Any, where: str) -> SceneObject:
    row = as_object(value, where)
    return SceneObject(
        tag=tag,
        category=as_text(*field(row, "Category", where)),
        status=as_text(*field(row, "Status", where), null=""),
        description=as_text(*field(row, "Visual_description", where), null=""),
        box_px=as_box(*field(row, "2d_bbox", where)),
        side=side_of_tag(tag),
        moving={"moving": True, "stationary": False, "parked": False}.get(str(row["Status"]).strip(" .").lower()),
        score=1.0,
        carried={**row, "Category": None, "2d_bbox": None} | {name: _nothing(row[name]) for name in _MAY_BE_NULL},
    )


def _nothing(value: Any) -> Any:
    """Which nothing the file writes, null or an empty text; what says something stands in the graph."""
    return None if value else value


def _questions_in(questions: Mapping[str, Any], where: str) -> tuple[QA, ...]:
    return tuple(
        _question_in(layer, row, f"{where}.{layer}[{number}]")
        for layer in LAYERS
        if layer in questions
        for number, row in enumerate(as_list(questions[layer], f"{where}.{layer}"))
    )


def _question_in(layer: str, value: Any, where: str) -> QA:
    row = as_object(value, where)
    above = row.get("con_up")
    return QA(
        layer=layer,  # type: ignore[arg-type]
        question=as_text(*field(row, "Q", where)),
        answer=as_text(*field(row, "A", where)),
        score=1.0,
        parents=tuple(above) if isinstance(above, list) and all(type(one) is int for one in above) else (),
        carried={**row, "Q": None, "A": None},
    )
