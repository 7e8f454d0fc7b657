"""The tool `answer_prompt` of the Direct methods, offered by the front end where `drivelm.whole_prompts` is set.

A prompt has a fixed structure: system line, context, query, what tools answered, passages (`template.py`).

With the embedded backend an extractive reader does: the sentence of context or passages that shares most with the query,
word for word. It is no language model and composes nothing. A passage that advises nothing hides no context that does.
"""

import hashlib
from collections.abc import Sequence
from typing import Annotated

import msgspec

from drivemcp.errors import ToolFailed
from evaluation.baselines.direct.answer_sources import Source, source_of, template_of
from evaluation.baselines.direct.parsed_advice import advice_of
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from evaluation.baselines.direct.template import Asked, Prompt, filled
from services.drivelm.reading.crops import Picture
from services.drivelm.service import Bindings


def answered(asked: Asked, template: Prompt, source: Source, picture: Picture | None = None) -> PromptAnswer:
    """The answer to a whole prompt and the advice in it; an abstention where it holds no advice. Raises ToolFailed as the source does."""
    prompt = filled(template, asked)
    text, score, took_ms = source.answer(asked, prompt, picture)
    advice = advice_of(text)
    return PromptAnswer(
        text=text[:400],
        score=score,
        method=source.method,
        backend=source.name,
        prompt_sha256=hashlib.sha256(prompt.encode()).hexdigest(),
        action=advice.action,
        value=advice.value,
        unit=advice.unit,
        hazard=advice.hazard,
        took_ms=took_ms,
    )


def shown(passages: Sequence[str], most: int = 600) -> tuple[str, ...]:
    """Passages as they go into the prompt: each one line, cut."""
    return tuple(" ".join(each.split())[:most] for each in passages)


def offer(front: Bindings) -> None:
    """Offer `answer_prompt` at the front end's node."""
    config, eyes = front.config, front.front_end.backend
    template = template_of(config)
    source = source_of(config, template, eyes, eyes.name)

    @front.node.tool(deadline_ms=60)
    def answer_prompt(
        query: Annotated[str, msgspec.Meta(max_length=400)],
        context: Annotated[str, msgspec.Meta(description="ego and scene, as text or JSON", max_length=8000)] = "",
        passages: Annotated[tuple[str, ...], msgspec.Meta(description="retrieved texts", max_length=20)] = (),
        tools: Annotated[tuple[str, ...], msgspec.Meta(description="what tools have answered", max_length=20)] = (),
    ) -> PromptAnswer:
        """Answer one prompt of the fixed structure (system line, context, query, tools, passages), and the advice found in the answer.

        For the evaluation's Direct methods. With the embedded backend a sentence of the prompt, word for word. Advice is
        taken by a closed grammar or not at all; it never acts.
        """
        asked = Asked(context, query, shown(passages), shown(tools))
        picture = front.frames.newest(config.graph_camera) if source.sees else None
        try:
            return answered(asked, template, source, picture)
        except ToolFailed as error:
            front.node.log.error("%s", error)  # a drive without its answers measures nothing
            raise
