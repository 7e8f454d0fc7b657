"""DriveLM's own file format, in and out: scenes of key frames with objects and questions by layer."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

from proto.scene import QA, SceneGraph, SceneObject
from services.drivelm.graph import CAMERA_TAGS

Layer = Literal["perception", "prediction", "planning", "behavior"]
LAYERS: tuple[Layer, ...] = get_args(Layer)


class UnreadableGraph(ValueError):
    """The JSON is not DriveLM's format; the message names what is missing."""


def to_drivelm(scene: str, frames: Mapping[str, SceneGraph]) -> dict[str, Any]:
    """One scene in DriveLM's form; ``frames`` by their key (for example the stamp)."""
    first = next(iter(frames.values()), None)
    key_frames = {key: _frame(graph) for key, graph in frames.items()}
    return {scene: {"scene_description": first.description if first else "", "key_frames": key_frames}}


def _frame(graph: SceneGraph) -> dict[str, Any]:
    objects = {
        shown.tag: {
            "Category": shown.category,
            "Status": shown.status or None,
            "Visual_description": shown.description,
            "2d_bbox": list(shown.box_px),
        }
        for shown in graph.objects
    }
    answers = {layer: [_question(qa) for qa in graph.qa if qa.layer == layer] for layer in LAYERS}
    tag = CAMERA_TAGS.get(graph.camera, graph.camera)
    return {"key_object_infos": objects, "QA": answers, "image_paths": {tag: f"frame-{graph.frame}.jpg"}}


def _question(qa: QA) -> dict[str, Any]:
    return {
        "Q": qa.question,
        "A": qa.answer,
        "C": None,
        "con_up": list(qa.parents) or None,
        "con_down": None,
        "cluster": None,
        "layer": None,
    }


def from_drivelm(document: Mapping[str, Any]) -> dict[str, list[SceneGraph]]:
    """Scenes of a DriveLM file as graphs. Annotations carry no score: theirs is 1. Raises ``UnreadableGraph``."""
    try:
        return {
            scene: [
                _graph(number, frame, body["scene_description"])
                for number, frame in enumerate(body["key_frames"].values())
            ]
            for scene, body in document.items()
        }
    except (KeyError, TypeError, AttributeError) as error:
        raise UnreadableGraph(f"not a DriveLM file: {type(error).__name__} {error}") from None


def _graph(number: int, frame: Mapping[str, Any], description: str) -> SceneGraph:
    objects = tuple(
        SceneObject(
            tag=tag,
            category=row["Category"],
            status=row["Status"] or "",
            description=row["Visual_description"],
            box_px=_box(row["2d_bbox"]),
        )
        for tag, row in frame["key_object_infos"].items()
    )
    qa = tuple(
        QA(layer=layer, question=row["Q"], answer=row["A"], score=1.0)
        for layer in LAYERS
        for row in frame["QA"].get(layer, ())
    )
    return SceneGraph(
        camera="front", frame=number, objects=objects, qa=qa, description=description, backend="annotation"
    )


def _box(values: Sequence[float]) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = (float(value) for value in values)
    return x0, y0, x1, y1
