"""The small network that reads a crop whole: signs, plates, gantry pictures, light states, or none of them."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivemcp.inference import CPU, open_session
from services.drivelm.vocabulary.classes import BY_KIND, OTHER, READER_CLASSES


class UnusableModel(ValueError):
    """The network's card is missing, or names classes that this version does not know."""


class Reading(NamedTuple):
    """What one crop may show, most likely first; probabilities of everything sum to one, the rest is ``other``."""

    label: str
    probability: float
    ranked: tuple[tuple[str, float], ...]


class Reader:
    """Wraps an ONNX Runtime session with one thread."""

    def __init__(self, session: Any, classes: tuple[str, ...]) -> None:
        self._session, self.classes = session, classes
        self._input = session.get_inputs()[0].name
        self._masks = {kind: np.isin(classes, labels) for kind, labels in BY_KIND.items()}
        self._other = classes.index(OTHER)

    @classmethod
    def load(cls, path: Path, providers: tuple[str, ...] = CPU) -> "Reader":
        """Load ``reader.onnx`` and the card beside it. Raises ``UnusableModel`` or ``FileNotFoundError``."""
        card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        classes = tuple(card["classes"])
        if unknown := set(classes) - set(READER_CLASSES):
            raise UnusableModel(f"{path.name} reads classes unknown here: {sorted(unknown)}; retrain or update")
        return cls(open_session(path, 1, providers), classes)

    def probabilities(self, crops: NDArray[np.uint8]) -> NDArray[np.float32]:
        """N x 48 x 48 x 3 RGB to N x classes, temperature included."""
        parts = [self._run(crops[start : start + 64]) for start in range(0, len(crops), 64)]
        return np.concatenate(parts) if parts else np.zeros((0, len(self.classes)), np.float32)

    def read(self, crops: NDArray[np.uint8], kinds: tuple[str, ...], keep: int = 4) -> tuple[Reading, ...]:
        """Read crops of boxes of the given kinds.

        What cannot be of that kind is no evidence for what can: its probability goes to ``other``, it is not spread.
        """
        return tuple(self._ranked(row, kind, keep) for row, kind in zip(self.probabilities(crops), kinds, strict=True))

    def _run(self, crops: NDArray[np.uint8]) -> NDArray[np.float32]:
        batch = np.ascontiguousarray(crops.transpose(0, 3, 1, 2), dtype=np.float32)
        return np.asarray(self._session.run(None, {self._input: batch})[0], np.float32)

    def _ranked(self, row: NDArray[np.float32], kind: str, keep: int) -> Reading:
        mask = self._masks[kind]
        allowed = np.where(mask, row, 0.0)
        allowed[self._other] += float(row[~mask].sum())
        order = np.argsort(-allowed)[:keep]
        ranked = tuple((self.classes[index], float(allowed[index])) for index in order)
        return Reading(ranked[0][0], ranked[0][1], ranked)
