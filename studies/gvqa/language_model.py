"""Answers of a language model to DriveLM's questions: the scene's objects in words, then the question. No picture goes to it."""

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from drivemcp.config import settings_of
from drivemcp.errors import UserError
from evaluation.baselines.direct.answer_sources import source_of
from evaluation.baselines.direct.template import Asked, filled, load
from proto.scene import SceneGraph, SceneObject
from services.drivelm.service import DrivelmConfig

EXAMPLES = Path(__file__).with_name("examples.toml")
"""The task by made-up examples, for models that do not follow instructions as well."""
NOTHING = "No object is known."
"""The scene without objects, as of a black picture."""


def answers_by(settings: Sequence[str]) -> Callable[[SceneGraph, str], str]:
    """What answers a question about a graph, by settings of `drivelm` (KEY=VALUE). Empty text: an abstention. Raises UserError."""
    try:
        config = msgspec.convert(settings_of([f"drivelm.{each}" for each in settings])["drivelm"], DrivelmConfig)
    except msgspec.ValidationError as error:
        raise UserError(f"--set: {error}") from None
    prompt = load(EXAMPLES)
    source = source_of(config, prompt, None, "embedded")

    def answer(graph: SceneGraph, question: str) -> str:
        asked = Asked(scene(graph), question)
        return source.answer(asked, filled(prompt, asked), None).text

    return answer


def scene(graph: SceneGraph) -> str:
    """A line an object."""
    return "\n".join(_line(each) for each in graph.objects) or NOTHING


def _line(shown: SceneObject) -> str:
    words = shown.description.rstrip(".") or shown.category
    parts = (f"{shown.tag}: {words}", shown.side and f"to the {shown.side}", shown.status.lower())
    return f"{', '.join(part for part in parts if part)}."
