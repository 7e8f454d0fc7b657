"""Endless labelled crops for the reader: faces before backgrounds, distractors and near misses as ``other``."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.vocabulary.classes import OTHER, READER_CLASSES
from training.sign_pictures.backgrounds import background_bank, distractor
from training.sign_pictures.degrade import BOX_JITTER, Chance, Conditions, View, any_conditions, seen_crop, view
from training.sign_pictures.faces import Face, draw_bank, drawable
from training.sign_pictures.fonts import letterings
from training.sign_pictures.odd import odd_faces

_GLOWING = ("led:", "light:")
_INDEX = {label: index for index, label in enumerate(READER_CLASSES)}
OTHER_SHARE = 0.18
LIGHT_JITTER = 0.1
"""How far off the boxes are of lights drawn alone to train with, as a share of their size: a head is narrow, and one that the box cuts was
told as nothing."""
# How often a class is drawn, beside 1.0 for all others: numbers are what matters most and is hardest to tell apart.
_WEIGHTS = {
    "limit:": 2.0, "limit_board:": 1.5, "led:": 1.4, "light:": 1.4, "zone:": 2.5, "border:": 0.6, "limit_end": 2.0,
    "no_vehicles": 2.0, "general": 1.5, "plate:when_wet": 1.4,
}  # fmt: skip
# What is mixed up most, and what mixing it up costs most: more of each.
_MIXED_UP = frozenset(
    {
        "limit:5", "limit:15", "limit:30", "limit:50", "limit:80", "limit:60", "limit:100", "limit:110", "limit:120",
        "limit_board:5", "limit_board:15", "limit_board:35", "limit_board:55", "limit_board:65", "limit_board:85",
    }
)  # fmt: skip
_MIXED_UP_FACTOR = 1.4
_MORE_IN_TRAINING = {"limit_board:": 1.5, "school_limit:": 2.0, "limit_board:30": 1.4, "limit_board:50": 1.4}
"""So many times as often in training as in scoring: in letterings that it does not know they are mixed up most."""


_APART = {"train": 0, "test": 1000, "tune": 2000}
"""Added to the seed, so that no two splits draw the same faces."""


class Source:
    """Draws crops of one split; no two share a lettering, ``train`` and ``test`` half of the backgrounds' families.
    ``tune``, for thresholds, stands before backgrounds like those of training."""

    def __init__(self, split: str, seed: int, font_folders: tuple[Path, ...], each: int = 60) -> None:
        self.letters = letterings(split, font_folders, seed)
        self.faces = draw_bank(drawable(), self.letters, each, seed + _APART[split])
        self.odd = odd_faces(self.letters, 12 * each, seed + _APART[split])
        tuning = split == "tune"
        self.grounds = background_bank("train" if tuning else split, 400, seed + (_APART[split] if tuning else 0))
        self._labels = drawable()
        self._light_jitter = LIGHT_JITTER if split == "train" else BOX_JITTER
        self._lights = [label for label in self._labels if label.startswith("light:")]
        shares = np.array([share_of(label) * (more_of(label) if split == "train" else 1.0) for label in self._labels])
        self._share = shares / shares.sum()

    def batch(
        self, count: int, chance: Chance, hard: float = 1.0, lights: bool = False
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float32]]:
        """``count`` crops (uint8 N x 48 x 48 x 3 RGB), class indexes, and sizes in camera pixels (0 for ``other``).
        ``lights``: of traffic lights alone, each state as often as any other."""
        drawn = [self.light(chance, hard) if lights else self.one(chance, hard) for _ in range(count)]
        crops, labels, sizes = zip(*drawn, strict=True)
        return np.stack(crops), np.array([_INDEX[label] for label in labels]), np.array(sizes, np.float32)

    def one(self, chance: Chance, hard: float = 1.0) -> tuple[Picture, str, float]:
        """One crop, its label, and the sign's true size."""
        if chance.random() < OTHER_SHARE:
            return self._other(chance), OTHER, 0.0
        label = self._labels[int(chance.choice(len(self._labels), p=self._share))]
        size = any_size(chance)
        taken = self.view_of(label, size, any_conditions(chance, hard), chance)
        return seen_crop(taken, chance), label, size

    def light(self, chance: Chance, hard: float = 1.0) -> tuple[Picture, str, float]:
        """One crop of a traffic light, its state, and its true size."""
        label, size = str(chance.choice(self._lights)), any_size(chance)
        taken = self.view_of(label, size, any_conditions(chance, hard), chance)
        return seen_crop(taken, chance, self._light_jitter), label, size

    def view_of(self, label: str, size_px: float, now: Conditions, chance: Chance, face: Face | None = None) -> View:
        """A picture of a class at a size under given conditions."""
        chosen = face if face is not None else self.face(label, chance)
        near = self.face(str(chance.choice(self._labels)), chance) if chance.random() < 0.3 else None
        return view(chosen, self._ground(chance), size_px, now, chance, label.startswith(_GLOWING), near)

    def face(self, label: str, chance: Chance) -> Face:
        """Any face of a class."""
        return self.faces[label][int(chance.integers(len(self.faces[label])))]

    def _ground(self, chance: Chance) -> Picture:
        return self.grounds[int(chance.integers(len(self.grounds)))]

    def _other(self, chance: Chance) -> Picture:
        now, size = any_conditions(chance), any_size(chance)
        kind = chance.random()
        if kind < 0.25:  # a sign, but none of those that are read
            odd = self.odd[int(chance.integers(len(self.odd)))]
            return seen_crop(view(odd, self._ground(chance), size, now, chance, False), chance)
        if kind < 0.5:
            return seen_crop(view(distractor(chance), self._ground(chance), size, now, chance, False), chance)
        if kind < 0.68:  # nothing but background and perhaps a post
            nothing = Face(np.zeros((32, 32, 4), np.uint8), float(chance.uniform(0.5, 2)))
            return seen_crop(view(nothing, self._ground(chance), size, now, chance, False), chance, 0.2)
        # A real sign that the box misses by more than half: beside, above, below, or a small corner of it.
        label = self._labels[int(chance.integers(len(self._labels)))]
        taken = self.view_of(label, size, now, chance)
        cut = crop(taken.picture, _missed(taken.region, chance))
        return cut if cut is not None else self._other(chance)


def any_size(chance: Chance) -> float:
    """Longer side of a sign in camera pixels: 9 to 75, most of them small."""
    return float(np.exp(chance.uniform(np.log(9), np.log(75))))


def share_of(label: str) -> float:
    """Share of a class among all crops that show one."""
    return _weight(label) / sum(_weight(other) for other in drawable())


def more_of(label: str) -> float:
    """How many times as often a class is trained on as its share of all crops has it."""
    return float(np.prod([factor for start, factor in _MORE_IN_TRAINING.items() if label.startswith(start)]))


def _weight(label: str) -> float:
    usual = next((weight for start, weight in _WEIGHTS.items() if label.startswith(start)), 1.0)
    return usual * (_MIXED_UP_FACTOR if label in _MIXED_UP else 1.0)


def _missed(region: Region, chance: Chance) -> Region:
    angle = chance.uniform(0, 2 * np.pi)
    reach = chance.uniform(0.65, 1.1)
    dx, dy = float(np.cos(angle)) * reach * region.width_px, float(np.sin(angle)) * reach * region.height_px
    return Region(region.x0_px + dx, region.y0_px + dy, region.x1_px + dx, region.y1_px + dy)
