"""The scene as DriveLM's graph: objects by tag, and questions and answers from perception to planning.

Everything said here is derived by stated rules from tracks, facts and the ego's motion; no network writes these
sentences. Questions and answers keep DriveLM's forms, so that tools made for its files can read ours.
"""

from collections.abc import Sequence

from proto.scene import Fact, SceneGraph
from services.drivelm.graph import planning, questions
from services.drivelm.graph.nodes import Node, Seen, seen_nodes
from services.drivelm.graph.templates import LAYERS

__all__ = ["NOTHING", "Seen", "build"]

NOTHING = "Nothing relevant is seen ahead."
"""The description of a scene without anything known in it; the eye may be blind."""


def build(seen: Seen) -> SceneGraph:
    """The graph of one instant."""
    nodes = seen_nodes(seen)
    qa = [*questions.rows(nodes, seen), *planning.rows(nodes, seen)]
    return SceneGraph(
        camera=seen.camera,
        frame=seen.frame,
        objects=tuple(node.shown for node in nodes),
        qa=tuple(sorted(qa, key=lambda one: LAYERS.index(one.layer))),
        description=describe(nodes, seen.facts),
        backend=seen.backend,
    )


def describe(nodes: Sequence[Node], facts: Sequence[Fact]) -> str:
    """The scene in a few plain sentences."""
    lines = [_actor(node) for node in nodes if node.track is not None]
    said = [*lines, *(line for fact in facts if (line := _fact(fact)))]
    return " ".join(said) or NOTHING


def _actor(node: Node) -> str:
    return f"There is a {questions.plain(node)} {node.distance_m:.0f} m ahead, to the {node.shown.side}."


def _fact(fact: Fact) -> str:
    where = f" about {fact.distance_m:.0f} m ahead" if fact.distance_m is not None and fact.distance_m > 0 else ""
    if fact.believed and fact.sentence:
        return fact.sentence.rstrip(".") + where + "."
    if not fact.candidates:
        return ""
    guesses = " or ".join(f"{c.reading} ({c.confidence:.2f})" for c in fact.candidates[:3])
    return f"A traffic element{where} is not read with certainty: {guesses}."
