"""What backends that are asked by prompts have in common: their name, their prompts, and the questions that have none."""

import logging
from abc import ABC, abstractmethod
from collections.abc import Sequence

from services.drivelm.backends.abstentions import UNMEASURED, Abstentions
from services.drivelm.backends.backend import Answer
from services.drivelm.backends.prompts import Prompts
from services.drivelm.reading.crops import Picture


class PromptedBackend(ABC):
    """A `SlowBackend` that sends a question's prompt with each picture."""

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
        return self._prompted(images, prompt, question)

    @abstractmethod
    def _prompted(self, images: Sequence[Picture], prompt: str, question: str) -> Sequence[Answer]:
        """One sentence or abstention per picture, all asked with the prompt of the question."""

    def free(self, image: Picture, prompt: str) -> tuple[str, float]:
        """Whatever text the model makes of a whole prompt, and its probability; an empty one is an abstention."""
        text, score, reason = self._free(image, prompt)
        if reason:
            return self._abstentions.note(reason).text, 0.0
        return text, UNMEASURED if score is None else score

    @abstractmethod
    def _free(self, image: Picture, prompt: str) -> tuple[str, float | None, str]:
        """Text, probability (None: not told), and why there is none."""
