"""The prompts, as versioned files: `prompt.toml` for models that follow instructions, `examples.toml` for base models."""

import hashlib
from pathlib import Path
from typing import NamedTuple

import msgspec

from evaluation.baselines.direct.forms import listed

INSTRUCTION, EXAMPLES = "prompt.toml", "examples.toml"


class Example(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A prompt with its answer, made up for the file: none is of a place that is driven."""

    context: str
    query: str
    answer: str
    passages: tuple[str, ...] = ()
    tools: tuple[str, ...] = ()


class Template(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The prompt as its file has it: `{sentences}` are the table's; `{context}`, `{query}`, `{passages}` and `{tools}` are filled in."""

    version: int
    head: str
    ask: str
    passages: str
    tools: str
    examples: tuple[Example, ...] = ()


class Asked(NamedTuple):
    """What goes into a prompt: the scene, the question, retrieved texts, and what the tools have answered."""

    context: str
    query: str
    passages: tuple[str, ...] = ()
    tools: tuple[str, ...] = ()


class Prompt(NamedTuple):
    """A template, the text that all its prompts begin with, and the hash of what is the same in all of them."""

    template: Template
    head: str
    sha256: str


def load(name: str | Path = INSTRUCTION) -> Prompt:
    """A template by its file's name here, or by its whole path. Raises OSError or msgspec.ValidationError."""
    template = msgspec.toml.decode((Path(__file__).parent / name).read_bytes(), type=Template)
    shown = (
        _case(template, Asked(each.context, each.query, each.passages, each.tools)) + f" {each.answer}\n\n"
        for each in template.examples
    )
    head = template.head.replace("{sentences}", listed()) + "".join(shown)
    same = "\0".join((head, template.ask, template.passages, template.tools))
    return Prompt(template, head, hashlib.sha256(same.encode()).hexdigest())


def filled(prompt: Prompt, asked: Asked) -> str:
    """The whole prompt. What is filled in is never looked into for further placeholders."""
    return prompt.head + _case(prompt.template, asked)


def _case(template: Template, asked: Asked) -> str:
    parts = {
        "context": asked.context,
        "query": asked.query,
        "passages": _listed(template.passages, asked.passages),
        "tools": _listed(template.tools, asked.tools),
    }
    whole, rest = "", template.ask
    while rest:
        before, brace, after = rest.partition("{")
        name, _, rest = after.partition("}")
        whole += before + (parts[name] if brace else "")
    return whole


def _listed(block: str, texts: tuple[str, ...]) -> str:
    before, _, after = block.partition("{listed}")
    lines = "\n".join(f"- {text}" for text in texts)
    return f"{before}{lines}{after}" if texts else ""
