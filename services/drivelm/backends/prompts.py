"""The prompts of language-model backends: one short, versioned file per question, filled in from the sentence table.

What is hashed is the text that is sent, so a changed sentence changes the hash as a changed file does.
"""

import hashlib
import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import msgspec

from services.drivelm.backends.abstentions import OFFERED, UNMEASURED, Abstentions, Said, judged
from services.drivelm.backends.backend import Answer
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.classes import OTHER, QUESTIONS, SENTENCES

FOLDER = Path(__file__).parent.parent / "prompts"
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


class PromptedBackend(ABC):
    """A `SlowBackend` that sends a question's prompt with each picture."""

    sees = True
    """Whether a picture goes to it with a whole prompt."""

    def __init__(self, label: str, prompts: Prompts) -> None:
        self._label, self._prompts = label, prompts
        self._abstentions = Abstentions(label, logging.getLogger("drivemcp.drivelm"))

    @property
    def name(self) -> str:
        """Backend and model, and the first digits of the SHA-256 of the prompts; it is in every trace."""
        return f"{self._label} prompts:{self._prompts.sha256[:12]}"

    @property
    def prompts(self) -> str:
        """SHA-256 of the prompts in use."""
        return self._prompts.sha256

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        """One sentence or abstention per picture."""
        prompt = self._prompts.texts.get(question)
        if prompt is None:
            return [self._abstentions.note("no prompt for this question", question) for _ in images]
        return [
            self._abstentions.note(said.reason, said.text)
            if said.reason
            else judged(said.text, question, said.score, self._abstentions)
            for said in self._say(images, prompt)
        ]

    def free(self, image: Picture | None, prompt: str) -> tuple[str, float]:
        """Whatever text the model makes of a whole prompt, and its probability; an empty one is an abstention."""
        if self.sees and image is None:
            return self._abstentions.note("no picture").text, 0.0
        (said,) = self._say([image if self.sees else None], prompt)
        if said.reason:
            return self._abstentions.note(said.reason).text, 0.0
        return said.text, UNMEASURED if said.score is None else said.score

    @abstractmethod
    def _say(self, images: Sequence[Picture | None], prompt: str) -> Sequence[Said]:
        """What the model says of each picture to the prompt. Raises nothing: whatever goes wrong is a reason to abstain."""
