"""The prompts of language-model backends: one short, versioned file per question, filled in from the sentence table.

What is hashed is the text that is sent, so a changed sentence changes the hash as a changed file does.
"""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import msgspec

from services.drivelm.vocabulary.classes import LIGHTS, OTHER, PANELS, PLATES, SIGNS
from services.drivelm.vocabulary.sentences import QUESTIONS, SENTENCES

FOLDER = Path(__file__).parent.parent / "prompts"
OFFERED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"sign": SIGNS, "plate": PLATES, "panel": PANELS, "light": LIGHTS}
)
"""Kind of box to the classes that an answer about it may name, besides `other`."""
_COUNTED = ("limit", "zone", "led", "limit_board")
"""Classes said by number: the file gives their form once."""


class PromptFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A prompt as written: `{question}`, `{sentences}` and `{abstention}` are filled in."""

    version: int
    ask: str


class Prompts(NamedTuple):
    """Question to the text that is sent, and the hash of all of them."""

    texts: Mapping[str, str]
    sha256: str


def load(folder: Path = FOLDER) -> Prompts:
    """The prompts of all questions. Raises OSError or msgspec.ValidationError where a file is missing or malformed."""
    texts = {question: _filled(folder / f"{kind}.toml", kind, question) for kind, question in QUESTIONS.items()}
    canonical = msgspec.json.encode(sorted(texts.items()))
    return Prompts(MappingProxyType(texts), hashlib.sha256(canonical).hexdigest())


def _filled(path: Path, kind: str, question: str) -> str:
    file = msgspec.toml.decode(path.read_bytes(), type=PromptFile)
    named = [label for label in OFFERED[kind] if not _is_counted(label)]
    sentences = "\n".join(SENTENCES[label] for label in named)
    return file.ask.strip().format(question=question, sentences=sentences, abstention=SENTENCES[OTHER])


def _is_counted(label: str) -> bool:
    head, _, tail = label.partition(":")
    return head in _COUNTED and tail.isdigit()
