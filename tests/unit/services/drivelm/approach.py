"""A drive past one sign, with a front end whose answers the test writes."""

from collections.abc import Callable, Sequence

import numpy as np

from proto.perception import Box, ObjectClass
from proto.scene import Fact
from proto.sensors import Calibration
from services.drivelm.backends.backend import Answer
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.classes import QUESTIONS, SENTENCES

TELE = Calibration(fx_px=1443, fy_px=1443, cx_px=320, cy_px=180, width_px=640, height_px=360)
PICTURE = np.random.default_rng(1).integers(0, 255, (360, 640, 3), np.uint8)
"""Something is to be seen everywhere."""
NS = 1_000_000_000
Say = Callable[[str, int], Answer]


def says(label: str, score: float = 0.97, *others: tuple[str, float]) -> Answer:
    """An answer in the front end's sentences."""
    rows = ((label, score), *others)
    return Answer(SENTENCES[label], score, tuple((SENTENCES[name], share) for name, share in rows))


def shows(image: Picture) -> bool:
    """Whether there is anything in a picture."""
    return bool((image != image[0, 0]).any())


class Scripted:
    """A backend that answers each question as the test says, if the picture shows anything; counts what it was asked."""

    name = "scripted"

    def __init__(self, sign: Say, plate: Say | None = None) -> None:
        self._say = {QUESTIONS["sign"]: sign, QUESTIONS["panel"]: sign, QUESTIONS["light"]: sign}
        self._say[QUESTIONS["plate"]] = plate or (lambda question, number: says("other", 0.98))
        self.asked: list[str] = []

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        self.asked += [question] * len(images)
        return [
            self._say[question](question, number) if shows(image) else says("other", 0.98)
            for number, image in enumerate(images)
        ]


def box_at(
    distance_m: float, lateral_m: float, kind: ObjectClass = "sign", track_id: int = 7, size_m: float = 0.6
) -> Box:
    """The box of a disc."""
    half, x = 1443 * size_m / distance_m / 2, 320 - 1443 * lateral_m / distance_m
    return Box(
        x0_px=x - half, y0_px=150 - half, x1_px=x + half, y1_px=150 + half, kind=kind, score=0.9, track_id=track_id
    )


def sighting(stamp_ns: int, *boxes: Box) -> Sighting:
    """A picture of the tele camera with these boxes."""
    return Sighting(camera="tele", stamp_ns=stamp_ns, boxes=boxes, open_picture=lambda: PICTURE, calibration=TELE)


def stand_before(end: FrontEnd, *, frames: int, per_s: int) -> None:
    """So many pictures of one sign 30 m away, which comes no nearer."""
    for step in range(frames):
        end.see(sighting(NS + step * NS // per_s, box_at(30, -3)))


def drive_past(
    end: FrontEnd, *, from_m: float = 60.0, speed_mps: float = 15.0, kind: ObjectClass = "sign", lateral_m: float = -3.5,
    camera: str = "tele", track_id: int = 7, size_m: float = 0.6, seen_until_m: float = 16.0, start_ns: int = NS,
) -> list[Fact]:  # fmt: skip
    """Five frames a second until the sign leaves the picture, then on until it is passed; all facts said."""
    said: list[Fact] = []
    distance_m, stamp_ns = from_m, start_ns
    while distance_m > -5.0:
        if distance_m > seen_until_m:
            boxes = (box_at(distance_m, lateral_m, kind, track_id, size_m),)
            said += end.see(
                Sighting(camera=camera, stamp_ns=stamp_ns, boxes=boxes, open_picture=lambda: PICTURE, calibration=TELE)
            )
        said += end.settle(stamp_ns, speed_mps)
        distance_m -= speed_mps * 0.2
        stamp_ns += NS // 5
    return said
