"""The front end of production without a look at pictures: what is read of a box is drawn from the reader's measured table."""

from collections.abc import Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from evaluation.corruption.chance import chance, ranked
from evaluation.modelled_sensors.card import Card, Reads
from evaluation.modelled_sensors.looks import misfit
from evaluation.modelled_sensors.noise import Drift, normal
from evaluation.modelled_sensors.sight import Lens, Thing, things
from evaluation.modelled_sensors.sign_faces import CLASSES
from proto.perception import Box
from proto.scene import Fact
from proto.truth import Truth
from services.drivelm.backends.backend import Answer
from services.drivelm.front_end import FrontEnd, Key, Look, Sighting
from services.drivelm.guard.answer_checks import Readings, Shown, inside
from services.drivelm.reading.crops import Picture, Region
from services.drivelm.vocabulary.classes import BY_KIND, KIND_OF_QUESTION, OTHER, READER_CLASSES
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from services.simulator.session import CAMERAS

NO_PICTURE: Picture = np.zeros((1, 1, 3), np.uint8)
MEMORY_S = 0.3
_NORMAL = NormalDist()


class NobodyLooks:
    """The backend's place: its answers are drawn by `ModelledFrontEnd`."""

    def __init__(self, name: str) -> None:
        self.name = name

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        """Never asked."""
        return [Answer("", 0.0)] * len(images)


class ModelledFrontEnd(FrontEnd):
    """Give it truth before the boxes of its pictures. Tracks, fusing, plates, places and the country are production's."""

    def __init__(self, card: Card, seed: int, *, home: str, max_reads: int) -> None:
        super().__init__(NobodyLooks("modelled"), home=home, max_reads=max_reads)
        self._reading, self._seed = card.reading, seed
        self._drift = Drift(seed)
        self._lenses = {name: Lens(camera) for name, camera in CAMERAS.items()}
        self._truth: tuple[int, Truth] | None = None
        self._there: dict[tuple[str, int], list[Thing]] = {}
        self._stamp_ns = 0

    def know(self, truth: Truth, stamp_ns: int) -> None:
        """What is so when the next pictures are taken."""
        self._truth, self._there = (stamp_ns, truth), {}

    def see(self, sighting: Sighting) -> tuple[Fact, ...]:
        """As production's, without its picture."""
        self._stamp_ns = sighting.stamp_ns
        return super().see(replace(sighting, open_picture=lambda: NO_PICTURE))

    def _look(self, key: Key, kind: str, region: Region, picture: Picture) -> list[Look]:
        camera = CAMERAS[key[0]]
        shown = Shown(region, camera.width_px, camera.height_px)
        question = next(question for question, each in KIND_OF_QUESTION.items() if each == kind)
        return [Look(key, question, picture, shown)] if inside(shown) else []

    def _probe(self, looks: Sequence[Look], stamp_ns: int) -> None:
        """There is no picture to probe with."""

    def _answers(self, looks: Sequence[Look], question: str) -> list[Readings]:
        kind = KIND_OF_QUESTION[question]
        return [self._read(look, kind) for look in looks]

    # -- one crop ---------------------------------------------------------------------------------------------------------

    def _read(self, look: Look, kind: str) -> Readings:
        thing = self._thing(look, kind)
        label = CLASSES.label(thing.code) if thing is not None else OTHER
        camera, region = look.key[0], look.shown.region
        if thing is None or label not in BY_KIND[kind]:
            return self._of_nothing(f"{camera}/{look.key[1]}", kind)
        row = self._row(label, max(region.height_px, region.width_px))
        whose = f"{thing.key}"
        own = normal(self._seed, "face", whose)
        now = self._drift.at("read", f"{camera}/{whose}", self._stamp_ns, MEMORY_S)
        alike = self._reading.alike
        luck = _NORMAL.cdf(alike**0.5 * own + (1.0 - alike) ** 0.5 * now)
        return self._drawn(label, row, luck, whose, kind)

    def _drawn(self, label: str, row: Reads, luck: float, whose: str, kind: str) -> Readings:
        sure, unsure = self._reading.sure, self._reading.unsure
        wrong = self._mistaken(label, whose, kind)
        if luck < row.sure_right:
            return ((label, sure), (OTHER, 1.0 - sure))
        if luck < row.right:
            return ((label, unsure), (wrong, (1.0 - unsure) / 2), (OTHER, (1.0 - unsure) / 2))
        if luck > 1.0 - row.sure_wrong:
            return ((wrong, sure), (OTHER, 1.0 - sure))
        return ((OTHER, unsure), (label, (1.0 - unsure) / 2), (wrong, (1.0 - unsure) / 2))

    def _of_nothing(self, whose: str, kind: str) -> Readings:
        sure = self._reading.sure
        if chance(self._seed, "nothing", whose) < self._reading.taken_for_a_sign:
            return ((self._mistaken(OTHER, whose, kind), sure), (OTHER, 1.0 - sure))
        return ((OTHER, sure),)

    def _mistaken(self, label: str, whose: str, kind: str) -> str:
        """What a face is mistaken for, all along: a number for another one of its kind of sign, else anything of its kind."""
        head, _, tail = label.partition(":")
        if tail.isdigit():
            others = [name for name in READER_CLASSES if name.startswith(f"{head}:") and name != label]
        else:
            others = [name for name in BY_KIND[kind] if name not in (label, OTHER)]
        if head == "limit" and tail.isdigit():
            listed = allowed_limits(self.here.jurisdiction, None) or frozenset()
            others = [name for name in others if int(name.partition(":")[2]) in listed] or others
        order = ranked(self._seed, frozenset(range(len(others))), "mistaken", whose)
        return others[order[0]] if others else OTHER

    def _row(self, label: str, px: float) -> Reads:
        """The table's row at a size of the longer side, between its neighbours."""
        head = label.partition(":")[0]
        rows = self._reading.rows.get(head, self._reading.rows["all_signs"])
        px *= self._reading.legible
        above = next((k for k, row in enumerate(rows) if row.px >= px), len(rows))
        if above in (0, len(rows)):
            return rows[min(above, len(rows) - 1)]
        low, high = rows[above - 1], rows[above]
        share = (px - low.px) / (high.px - low.px)
        return Reads(
            px=px,
            right=low.right + share * (high.right - low.right),
            sure_right=low.sure_right + share * (high.sure_right - low.sure_right),
            sure_wrong=low.sure_wrong + share * (high.sure_wrong - low.sure_wrong),
        )

    def _thing(self, look: Look, kind: str) -> Thing | None:
        """What the box is of, by truth at the picture's stamp."""
        if self._truth is None or self._truth[0] != self._stamp_ns:
            return None
        camera, region = look.key[0], look.shown.region
        key = camera, self._stamp_ns
        if key not in self._there:
            self._there[key] = [
                each for each in things(self._truth[1], self._lenses[camera]) if ":" in each.code or " " in each.code
            ]
        fits = [
            (cost, k)
            for k, thing in enumerate(self._there[key])
            if _is_plate(thing) == (kind == "plate") and (cost := misfit(thing, _box(region))) is not None
        ]
        return self._there[key][min(fits)[1]] if fits else None


def _is_plate(thing: Thing) -> bool:
    return " plate" in thing.code


def _box(region: Region) -> Box:
    return Box(x0_px=region.x0_px, y0_px=region.y0_px, x1_px=region.x1_px, y1_px=region.y1_px, kind="sign", score=1.0)
