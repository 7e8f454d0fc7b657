"""Free questions about the scene: an extractive reader. It picks the sentences of the scene graph that share most with
the question and says them as they are; it composes nothing, and where nothing fits it says so."""

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from proto.scene import SceneGraph
from services.drivelm.text import cleaned

ENOUGH = 0.34
"""Share of the question's weighted words that a sentence must cover to be an answer."""
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


class Found(NamedTuple):
    """The extracted answer, how much of the question it covers times how sure the graph is, and where it stood."""

    text: str
    score: float
    layer: str


def ask(graph: SceneGraph, question: str) -> Found:
    """The best sentence of the graph for a question; ``SILENT`` with score 0 where none covers it."""
    wanted = words(cleaned(question))
    sentences = _sentences(graph)
    if not wanted or not sentences:
        return Found(SILENT, 0.0, "")
    rarity = _rarity([words(f"{asked} {said}") for asked, said, _, _ in sentences])
    total = sum(rarity.get(word, 3.0) for word in wanted)
    best, best_score = Found(SILENT, 0.0, ""), 0.0
    for asked, said, sure, layer in sentences:
        shared = wanted & words(f"{asked} {said}")
        cover = sum(rarity.get(word, 3.0) for word in shared) / total
        if cover >= ENOUGH and cover * sure > best_score:
            best, best_score = Found(said, round(cover * sure, 4), layer), cover * sure
    return best


def words(text: str) -> frozenset[str]:
    """The words that carry meaning, unified."""
    plain = (_SAME.get(word, word) for word in re.findall(r"[a-zäöüß0-9]+", text.lower()))
    return frozenset(word for word in plain if word not in _STOP)


def _sentences(graph: SceneGraph) -> list[tuple[str, str, float, str]]:
    rows = [(qa.question, qa.answer, qa.score, str(qa.layer)) for qa in graph.qa if qa.answer]
    parts = re.split(r"(?<=\.)\s+", graph.description)
    return [*(("", part, 1.0, "description") for part in parts if part), *rows]


def _rarity(documents: Sequence[frozenset[str]]) -> dict[str, float]:
    count = len(documents)
    every = frozenset().union(*documents)
    return {word: math.log(1 + count / sum(word in document for document in documents)) for word in every}
