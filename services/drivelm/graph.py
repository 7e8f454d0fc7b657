"""The scene as DriveLM's graph: objects by tag, and questions and answers from perception to planning.

Everything said here is derived by stated rules from tracks, facts and the ego's motion; no network writes these
sentences. Questions and answers keep DriveLM's forms, so that tools made for its files can read ours.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

from proto.perception import Box, Track
from proto.scene import QA, Fact, SceneGraph, SceneObject
from proto.vehicle import Ego
from services.drivelm import plan_rules
from services.drivelm.sentences import SENTENCES

CAMERA_TAGS = {"front": "CAM_FRONT", "tele": "CAM_FRONT_TELE"}
Layer = Literal["perception", "prediction", "planning", "behavior"]
LAYERS: tuple[Layer, ...] = get_args(Layer)
_MOST_OBJECTS = 12


class Seen(NamedTuple):
    """What the graph is built from, all of about one instant."""

    camera: str
    frame: int
    boxes: Sequence[Box] = ()
    tracks: Sequence[Track] = ()
    facts: Sequence[Fact] = ()
    ego: Ego | None = None
    backend: str = ""


class Node(NamedTuple):
    """An object of the graph with what lies behind it."""

    shown: SceneObject
    track: Track | None = None
    fact: Fact | None = None

    @property
    def distance_m(self) -> float:
        """How far ahead; unknown is far."""
        if self.track is not None:
            return self.track.x_m
        return self.fact.distance_m if self.fact is not None and self.fact.distance_m is not None else 1e3

    @property
    def side(self) -> str:
        """Where it is, in DriveLM's words."""
        y_m = self.track.y_m if self.track is not None else self.fact.lateral_m if self.fact is not None else None
        if y_m is None or abs(y_m) < 1.8:
            return "front"
        return "front left" if y_m > 0 else "front right"


def build(seen: Seen) -> SceneGraph:
    """The graph of one instant."""
    nodes = _nodes(seen)
    qa = [*_perception(nodes), *_prediction(nodes), *_planning(nodes, seen), plan_rules.behavior(seen.ego)]
    return SceneGraph(
        camera=seen.camera,
        frame=seen.frame,
        objects=tuple(node.shown for node in nodes),
        qa=tuple(qa),
        description=describe(nodes, seen),
        backend=seen.backend,
    )


def _nodes(seen: Seen) -> list[Node]:
    tracks = {track.track_id: track for track in seen.tracks}
    facts = {fact.track_id: fact for fact in seen.facts if fact.track_id and fact.kind != "jurisdiction"}
    found = []
    for box in seen.boxes:
        track, fact = tracks.get(box.track_id), facts.get(box.track_id)
        is_actor = box.kind in ("vehicle", "pedestrian")
        if not box.track_id or (is_actor and track is None) or (not is_actor and fact is None):
            continue
        found.append((box, track if is_actor else None, None if is_actor else fact))
    found.sort(key=lambda row: row[1].x_m if row[1] else (row[2].distance_m or 1e3) if row[2] else 1e3)
    return [_node(number, *row, seen.camera) for number, row in enumerate(found[:_MOST_OBJECTS], 1)]


def _node(number: int, box: Box, track: Track | None, fact: Fact | None, camera: str) -> Node:
    x, y = (box.x0_px + box.x1_px) / 2, (box.y0_px + box.y1_px) / 2
    shown = SceneObject(
        tag=f"<c{number},{CAMERA_TAGS.get(camera, 'CAM_' + camera.upper())},{x:.1f},{y:.1f}>",
        category="Traffic element" if track is None else track.kind.capitalize(),
        status="" if track is None else plan_rules.status(track),
        description=_looks(track, fact),
        box_px=(box.x0_px, box.y0_px, box.x1_px, box.y1_px),
        track_id=box.track_id,
    )
    return Node(shown, track, fact)


def _looks(track: Track | None, fact: Fact | None) -> str:
    if track is not None:
        return f"{track.kind.capitalize()}."
    if fact is None:
        return ""
    if not fact.believed:
        return "Traffic sign that is not read with certainty."
    return SENTENCES.get(fact.reading, fact.sentence) or "Traffic element."


def _perception(nodes: Sequence[Node]) -> list[QA]:
    names = [f"a {_plain(node)} to the {node.side} of the ego vehicle" for node in nodes]
    tags = ", ".join(node.shown.tag for node in nodes)
    important = (
        "There is " + ", ".join(names) + f". The IDs of these objects are {tags}." if nodes else "There are none."
    )
    rows = [
        _qa(
            "perception",
            "What are the important objects in the current scene? Those objects will be considered for the future "
            "reasoning and driving decision.",
            important,
            1.0,
        )
    ]
    for node in nodes:
        if node.track is not None:
            asked = f"What is the moving status of object {node.shown.tag}?"
            rows.append(_qa("perception", asked, plan_rules.moving(node.track), node.track.confidence, 0))
        asked = f"What is the visual description of {node.shown.tag}?"
        rows.append(_qa("perception", asked, node.shown.description, _score(node), 0))
    elements = [node for node in nodes if node.fact is not None]
    answer = "Yes, there are traffic elements in the front view." if elements else "No."
    return [*rows, _qa("perception", "Is there any traffic element in the front view?", answer, 1.0, 0)]


def _prediction(nodes: Sequence[Node]) -> list[QA]:
    rows = []
    for node in nodes:
        if node.fact is not None:
            kind = "Traffic light." if node.fact.kind == "light" else "Traffic sign."
            rows.append(_qa("prediction", f"What kind of traffic sign is {node.shown.tag}?", kind, _score(node), 0))
        elif node.track is not None:
            asked = f"Will {node.shown.tag} be in the moving direction of the ego vehicle?"
            rows.append(_qa("prediction", asked, "Yes." if node.track.in_ego_path else "No.", _score(node), 0))
    return rows


def _planning(nodes: Sequence[Node], seen: Seen) -> list[QA]:
    order = sorted(nodes, key=lambda node: (plan_rules.urgency(node.track, node.fact), node.distance_m))
    concern = [node for node in order if plan_rules.urgency(node.track, node.fact) < plan_rules.NO_CONCERN]
    tags = ", ".join(node.shown.tag for node in order) or "empty"
    rows = [
        _qa(
            "planning",
            "What is the priority of the objects that the ego vehicle should consider?(in descending order)",
            f"The priority of the objects that the ego vehicle should consider (in descending order) is {tags}.",
            1.0,
            0,
        )
    ]
    for node in concern:
        action = plan_rules.action(node.track, node.fact, seen.ego)
        asked = f"Based on {node.shown.tag} in this scene, what is the most possible action of the ego vehicle?"
        rows.append(_qa("planning", asked, action, _score(node), 0))
    lights = [node for node in nodes if node.fact is not None and node.fact.kind == "light"]
    said = lights[0].shown.description if lights else "None."
    asked = "What is the traffic signal that the ego vehicle should pay attention to?"
    return [*rows, _qa("planning", asked, said, _score(lights[0]) if lights else 1.0, 0)]


def describe(nodes: Sequence[Node], seen: Seen) -> str:
    """The scene in a few plain sentences."""
    actors = [node for node in nodes if node.track is not None]
    lines = [f"There is a {_plain(node)} {node.distance_m:.0f} m ahead, to the {node.side}." for node in actors]
    for fact in seen.facts:
        where = f" about {fact.distance_m:.0f} m ahead" if fact.distance_m is not None and fact.distance_m > 0 else ""
        if fact.believed and fact.sentence:
            lines.append(fact.sentence.rstrip(".") + where + ".")
        elif fact.candidates:
            guesses = " or ".join(f"{c.reading} ({c.confidence:.2f})" for c in fact.candidates[:3])
            lines.append(f"A traffic element{where} is not read with certainty: {guesses}.")
    return " ".join(lines) or "Nothing relevant is seen ahead."


def _plain(node: Node) -> str:
    if node.track is not None:
        return f"{plan_rules.status(node.track).lower()} {node.track.kind}"
    return "traffic light" if node.fact is not None and node.fact.kind == "light" else "traffic sign"


def _score(node: Node) -> float:
    source = node.track or node.fact
    return round(source.confidence, 4) if source is not None else 0.0


def _qa(layer: str, question: str, answer: str, score: float, *parents: int) -> QA:
    return QA(layer=layer, question=question, answer=answer, score=score, parents=parents)  # type: ignore[arg-type]
