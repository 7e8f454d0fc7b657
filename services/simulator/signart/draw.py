"""Drawing a face by its code."""

import numpy as np

from services.simulator.signart.catalogue import FACES, Face
from services.simulator.signart.lettering import Lettering, lettering
from services.simulator.signart.painter import Image, Painter
from services.simulator.signart.plates import lamp_grid
from services.simulator.signart.sheet import Sheet, palette


class UnknownSign(LookupError):
    """There is no such code in that country's table."""


def face_size_m(country: str, code: str) -> tuple[float, float]:
    """Width and height of the face in metres, as it stands beside a rural road."""
    return _face(country, code).size_m


def draw_face(country: str, code: str, *, text: str = "", font: int = 0, size_px: int = 256, seed: int = 0) -> Image:
    """Draw one face.

    ``font`` 0 is the country's own lettering, other numbers are variety; ``text`` fills boards and plates that carry
    words (``\\n`` breaks a line); ``seed`` 0 is a new sign, others are weathered. The longer side is ``size_px``.
    Returns uint8 RGBA, H x W x 4, alpha not premultiplied. Raises ``UnknownSign``.
    """
    return draw_lettered(country, code, lettering(font, country), text=text, size_px=size_px, seed=seed)


def draw_lettered(
    country: str, code: str, letters: Lettering, *, text: str = "", size_px: int = 256, seed: int = 0
) -> Image:
    """``draw_face`` with letters of the caller's own, for more variety in training."""
    face = _face(country, code)
    painter = Painter(*face.size_m, size_px)
    face.draw(painter, Sheet(country, text, letters, palette(seed)), face.argument)
    picture = painter.picture()
    if code.startswith("led:"):
        return lamp_grid(picture, lamps=40)
    return picture if seed == 0 else _weathered(picture, seed)


def _face(country: str, code: str) -> Face:
    try:
        return FACES[country][code]
    except KeyError:
        raise UnknownSign(f"no sign {code!r} for {country!r}; see signart.CODES") from None


def _weathered(picture: Image, seed: int) -> Image:
    """Uneven dirt: a slow gradient and a few streaks running down."""
    chance = np.random.default_rng([seed, 1])
    height, width = picture.shape[:2]
    slope = chance.uniform(-0.12, 0.12, 2)
    shade = 1.0 + slope[0] * np.linspace(-1, 1, width)[None, :] + slope[1] * np.linspace(-1, 1, height)[:, None]
    streaks = np.ones(width)
    for _ in range(int(chance.integers(0, 4))):
        centre, spread = chance.uniform(0, width), chance.uniform(0.01, 0.06) * width
        streaks -= chance.uniform(0.0, 0.22) * np.exp(-(((np.arange(width) - centre) / spread) ** 2))
    worn = picture.copy()
    worn[..., :3] = np.clip(picture[..., :3] * (shade * streaks[None, :])[..., None], 0, 255).astype(np.uint8)
    return worn
