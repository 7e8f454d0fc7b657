"""The bank of drawn faces a reader learns from: every class in every country, lettering and state of wear."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.modelled_sensors.sign_faces import orders
from services.drivelm.vocabulary.classes import LIGHTS, PANELS, PLATES, SIGNS
from services.simulator.signart.draw import draw_lettered, face_size_m
from services.simulator.signart.lettering import Lettering
from training.sign_pictures.lights import draw_head
from training.sign_pictures.texts import text_for

Picture = NDArray[np.uint8]
Chance = np.random.Generator


class Face(NamedTuple):
    """A drawn face and how wide it is for its height."""

    picture: Picture
    aspect: float


def draw_bank(labels: tuple[str, ...], letters: dict[str, Lettering], each: int, seed: int) -> dict[str, list[Face]]:
    """``each`` faces per class, RGBA with the longer side 112 px."""
    chance = np.random.default_rng([seed, 11])
    return {label: [_draw(label, letters, chance) for _ in range(each)] for label in labels}


def _draw(label: str, letters: dict[str, Lettering], chance: Chance) -> Face:
    if label in LIGHTS:
        head = draw_head(label, chance)
        return Face(head, head.shape[1] / head.shape[0])
    choices = orders(label)
    order = choices[int(chance.integers(len(choices)))]
    lettering = letters[str(chance.choice(sorted(letters)))]
    seed = int(chance.integers(0, 1 << 30)) if chance.random() < 0.8 else 0
    text = text_for(order.text, chance)
    picture = draw_lettered(order.country, order.code, lettering, text=text, size_px=112, seed=seed)
    width_m, height_m = face_size_m(order.country, order.code)
    return Face(picture, width_m / height_m)


def drawable() -> tuple[str, ...]:
    """Every class that is drawn from a face (all but ``other``)."""
    return (*SIGNS, *PLATES, *PANELS, *LIGHTS)
