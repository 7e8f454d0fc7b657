"""Questions about the scene. One in a form of DriveLM's is answered by the graph's row of that form and those objects,
or from the objects it lists; else it is not answered. Any other is for the extractive reader: it picks the sentence of
the scene graph that shares most with the question and says it as it is; it composes nothing, and where nothing fits it
says so."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from proto.scene import QA, SceneGraph
from services.drivelm.graph import listing, planning, questions
from services.drivelm.graph.nodes import Seen, listed_nodes
from services.drivelm.graph.scene_graph import NOTHING
from services.drivelm.graph.tags import NEAR_PX, Point, apart_px
from services.drivelm.graph.templates import FORMS, UNANSWERED, Asked, in_family, recognise
from services.drivelm.vocabulary.text import cleaned

ENOUGH = 0.34
"""Share of the question's weighted words that a sentence must cover to be an answer."""
UNLISTED = 0.5
"""A sign that another camera saw is described, and no object of the graph's own picture."""
SILENT = "The scene graph says nothing about that."
_STOP_WORDS = """
a an and are at be by can could do does for from has have how i in is it its me of on or say says should that the there
this to was we what when where which who why will with you your current scene please tell now any ego vehicle
"""
_STOP = frozenset(_STOP_WORDS.split())
# Words that mean the same here; the right side is what the sentences use.
_SAME = {
    "car": "vehicle", "cars": "vehicle", "vehicles": "vehicle", "truck": "vehicle", "person": "pedestrian", "people": "pedestrian",
    "pedestrians": "pedestrian", "speed": "limit", "limits": "limit", "allowed": "limit", "fast": "limit", "signal": "light",
    "lights": "light", "lamp": "light", "signs": "sign", "ahead": "front", "board": "panel", "gantry": "panel",
    "country": "border", "action": "action", "actions": "action", "behaviour": "behavior",
}  # fmt: skip


EXTRACTED = "extractive: a sentence of the scene graph, chosen by shared words"
IN_FORM = "the scene graph's own answer to this form of question"
COUNTED = "counted from the objects of the scene graph"


class Found(NamedTuple):
    """The answer, how sure it is (of an extracted one: how much of the question it covers times how sure the graph is),
    where it stood, and how it was found."""

    text: str
    score: float
    layer: str
    method: str = EXTRACTED


def ask(graph: SceneGraph, question: str) -> Found:
    """The graph's answer to a question; ``SILENT`` with score 0 where it has none."""
    asked = recognise(question)
    return in_form(graph, asked) if asked is not None else extracted(graph, question)


def in_form(graph: SceneGraph, asked: Asked) -> Found:
    """The answer to a question in one of DriveLM's forms, of its objects and of no others."""
    layer = {**FORMS, **UNANSWERED}[asked.family][0]
    if (row := _answered(graph.qa, asked)) is not None:
        return Found(row.answer, row.score, layer, IN_FORM)
    if (counted := listing.answer(graph, asked)) is not None:
        return Found(counted.text, counted.score, layer, COUNTED)
    told = _answered(_from_objects(graph), asked)
    return Found(told.answer, told.score, layer, IN_FORM) if told is not None else Found(SILENT, 0.0, layer, IN_FORM)


def _answered(rows: Sequence[QA], asked: Asked) -> QA | None:
    """The row of the same form and words, whose tags mean the same objects; without an answer or a score, none."""
    return next(
        (qa for qa in rows if qa.answer and qa.score > 0 and _same(in_family(qa.question, asked.family), asked)), None
    )


def _same(one: Asked | None, other: Asked) -> bool:
    if one is None or one.words != other.words or len(one.tags) != len(other.tags):
        return False
    return all(_near(*both) for both in zip(one.tags, other.tags, strict=True))


def _near(one: Point, other: Point) -> bool:
    return apart_px(one, other) < NEAR_PX


def _from_objects(graph: SceneGraph) -> list[QA]:
    """What the objects alone tell: for a graph that came from a file, and lists them without our questions."""
    if graph.backend != "annotation":
        return []
    nodes, seen = listed_nodes(graph.objects), Seen(camera=graph.camera, frame=graph.frame)
    return [*questions.rows(nodes, seen), *planning.rows(nodes, seen)]


def extracted(graph: SceneGraph, question: str) -> Found:
    """The best sentence of the graph for a free question; ``SILENT`` with score 0 where none covers it."""
    wanted, sentences = words(cleaned(question)), _sentences(graph)
    if not wanted or not sentences:
        return Found(SILENT, 0.0, "")
    held = [words(f"{each.asked} {each.said}") for each in sentences]
    rarity = _rarity(held)
    total = sum(rarity.get(word, 3.0) for word in wanted)
    best, most = Found(SILENT, 0.0, ""), 0.0
    for sentence, its_words in zip(sentences, held, strict=True):
        cover = sum(rarity.get(word, 3.0) for word in wanted & its_words) / total
        if cover >= ENOUGH and cover * sentence.weight > most:
            most = cover * sentence.weight
            best = Found(sentence.said, round(cover * sentence.sure, 4), sentence.layer)
    return best


def words(text: str) -> frozenset[str]:
    """The words that carry meaning, unified."""
    plain = (_SAME.get(word, word) for word in re.findall(r"[a-zäöüß0-9]+", text.lower()))
    return frozenset(word for word in plain if word not in _STOP)


class _Sentence(NamedTuple):
    """What the graph says, to which question, and how sure it is; `weight`: of equally fitting ones the greater is chosen."""

    asked: str
    said: str
    weight: float
    sure: float
    layer: str


def _sentences(graph: SceneGraph) -> list[_Sentence]:
    """The description first: it is the answer to nothing in particular, and fits a free question best."""
    told, sure = "" if graph.description == NOTHING else graph.description, _described(graph)
    parts = [_Sentence("", part, 1.0, sure, "description") for part in re.split(r"(?<=\.)\s+", told) if part]
    return parts + [
        _Sentence(qa.question, qa.answer, qa.score, qa.score, str(qa.layer)) for qa in graph.qa if qa.answer
    ]


def _described(graph: SceneGraph) -> float:
    """How sure the description is: as its least sure object; of what no object of the picture tells, no surer than ``UNLISTED``."""
    return min((shown.score for shown in graph.objects if shown.score > 0), default=UNLISTED)


def _rarity(documents: Sequence[frozenset[str]]) -> dict[str, float]:
    count, holding = len(documents), Counter(word for document in documents for word in document)
    return {word: math.log(1 + count / found) for word, found in holding.items()}
