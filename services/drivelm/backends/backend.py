"""The front end's interface, and the backend that runs everywhere: small readers that answer in sentences.

``Backend`` is what any front end must offer: pictures and one question in, one answer each out. The embedded backend
answers the four targeted questions about a cropped traffic element (``sentences.QUESTIONS``) with a trained reader;
any other question it leaves unanswered (score 0): free questions are answered from the scene graph (``ask.py``).
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import cv2
import numpy as np

from services.drivelm.reading.crops import CROP_PX, Picture
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import KIND_OF_QUESTION, SENTENCES


class Answer(NamedTuple):
    """What the front end says of one picture, how sure it is (0 to 1), and what else it may be."""

    text: str
    score: float
    alternatives: tuple[tuple[str, float], ...] = ()
    measured: bool = True
    """Whether the score comes from the model's own probabilities; False: a constant stands in for them."""


class Backend(Protocol):
    """A vision-language front end."""

    @property
    def name(self) -> str:
        """Its name for logs: backend and model."""

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        """One answer per picture (uint8 H x W x 3 RGB), all to the same question."""


class SlowBackend(Backend, Protocol):
    """A backend that may take seconds: it is asked on threads of its own (``backends/late.py``), never in a tick."""

    @property
    def sees(self) -> bool:
        """Whether a picture goes to it."""

    @property
    def prompts(self) -> str:
        """SHA-256 of the prompts in use, for the trace."""

    def free(self, image: Picture | None, prompt: str) -> tuple[str, float]:
        """Whatever text the model makes of a whole prompt, and its probability; an empty one is an abstention."""


NO_ANSWER = Answer("", 0.0)
"""Abstention."""


class EmbeddedBackend:
    """The default: a classifier of whole signs, its classes said as sentences. Runs on a CPU in a millisecond."""

    def __init__(self, reader: Reader, digest: str = "") -> None:
        self._reader, self._digest = reader, digest

    @property
    def name(self) -> str:
        """`embedded` and the first digits of the network's SHA-256."""
        return f"embedded:{self._digest[:12]}" if self._digest else "embedded"

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        """Sentences for crops of traffic elements; nothing for questions other than the targeted ones."""
        kind = KIND_OF_QUESTION.get(question)
        if kind is None or not images:
            return [NO_ANSWER] * len(images)
        crops = np.stack([_sized(image) for image in images])
        readings = self._reader.read(crops, (kind,) * len(images))
        return [
            Answer(
                SENTENCES[reading.label],
                reading.probability,
                tuple((SENTENCES[label], probability) for label, probability in reading.ranked),
            )
            for reading in readings
        ]


def _sized(image: Picture) -> Picture:
    if image.shape[:2] == (CROP_PX, CROP_PX):
        return image
    return np.asarray(cv2.resize(image, (CROP_PX, CROP_PX), interpolation=cv2.INTER_AREA), np.uint8)
