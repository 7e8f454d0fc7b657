"""The front end with a slow backend: the sign reader answers at once, the backend when it can, and nothing waits for it.

Each look goes to the embedded reader as ever, which keeps the tracks, and is sent off to the backend besides. An answer
that comes later counts for its track with the stamp of its picture, unless the track is gone or has since become another
thing. Nor does it count for what changes (lights, panels) where the picture is too old to tell of that.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import cv2
import numpy as np

from proto.perception import Box
from proto.scene import Fact
from services.drivelm.backends.backend import Answer, Backend, SlowBackend
from services.drivelm.backends.background_worker import BackgroundWorker, PendingQuestion
from services.drivelm.front_end import FrontEnd, Look, Sighting
from services.drivelm.guard.probes import Probe
from services.drivelm.ocr.lettering import Lettering
from services.drivelm.reading import plates
from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.vocabulary.classes import KIND_OF_QUESTION

VIEW_PX = 224
"""Longer side of the view."""


def view(picture: Picture, region: Region, size_px: int = VIEW_PX) -> Picture | None:
    """The region of a picture (uint8 H x W x 3 RGB), its longer side `size_px` long. None where `crop` gives none."""
    square = crop(picture, region, size_px)
    if square is None:
        return None
    scale = size_px / max(region.width_px, region.height_px)
    width, height = (max(1, round(side * scale)) for side in (region.width_px, region.height_px))
    return np.asarray(cv2.resize(square, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def enlarged(image: Picture, size_px: int = VIEW_PX) -> Picture:
    """A small picture (a crop of the sign reader's) at the size of a view."""
    return np.asarray(cv2.resize(image, (size_px, size_px), interpolation=cv2.INTER_LINEAR), np.uint8)


AGREEING = 3
"""Answers in a row, of different pictures of one thing, that must agree before one counts as clear."""
AGREED = 0.8
"""The score it then counts with: just clear (``evidence.CLEAR``, 0.75), so that belief takes one more of them."""
Topic = tuple[object, ...]


class Agreement:
    """How often in a row the same was said of each thing, by answers whose score is a stated constant."""

    def __init__(self) -> None:
        self._runs: dict[Topic, tuple[str, int]] = {}

    def weighed(self, topic: Topic, answer: Answer) -> Answer:
        """The answer, its score raised from the third agreeing one on. Abstentions neither add nor break."""
        if answer.measured or not answer.text:
            return answer
        said, count = self._runs.get(topic, ("", 0))
        count = count + 1 if said == answer.text else 1
        self._runs[topic] = (answer.text, count)
        return answer._replace(score=max(answer.score, AGREED)) if count >= AGREEING else answer

    def keep(self, topics: set[Topic]) -> None:
        """Forget all others."""
        self._runs = {topic: run for topic, run in self._runs.items() if topic in topics}


CHANGING = ("light", "panel")
CHANGES_NS = 2_000_000_000
"""After which an answer about a light or a panel tells nothing of it any more; a green light counts no longer either."""


class Sent(NamedTuple):
    """What was sent off: a look, or a probe of the backend with the look that it was made from."""

    look: Look
    probe: Probe | None = None


class LateFrontEnd(FrontEnd):
    """As the front end, for backends that take their time. All methods belong to the worker thread."""

    def __init__(
        self, backend: SlowBackend, reader: Backend, *, home: str = "", max_reads: int = 8,
        lettering: Lettering | None = None, outstanding: int = 2, max_age_s: float = 4.0, guarded: bool = True,
    ) -> None:  # fmt: skip
        """`worker.ready` is to be set to what calls `arrive` on the worker thread."""
        super().__init__(
            backend, home=home, max_reads=max_reads, lettering=lettering, reader_backend=reader, guarded=guarded
        )
        self.worker = BackgroundWorker[Sent](backend, outstanding=outstanding, max_age_ns=int(max_age_s * 1e9))
        self._agreement = Agreement()
        self._picture: Picture | None = None
        self._seeing_ns = 0

    def see(self, sighting: Sighting) -> tuple[Fact, ...]:
        """Read with the embedded reader, send off to the slow backend, and say what both have told so far."""
        self._forget_changed(sighting.stamp_ns)
        facts = super().see(sighting)
        self._picture = None
        return facts

    def arrive(self) -> None:
        """Take what the backend has answered since; it is said with the next picture, or when the thing is passed."""
        self._agreement.keep({(key, question) for key in self.tracks for question in KIND_OF_QUESTION})
        for pending, answers in self.worker.collect():
            look, probe = pending.subject
            if not self._still_tells(pending):
                continue
            self._seeing_ns = pending.stamp_ns
            if probe is None:
                self._hear([look], self._weighed(look, answers), pending.stamp_ns)
            elif answers[0].text:
                self._tried(probe, look, answers)

    def _weighed(self, look: Look, answers: Sequence[Answer]) -> list[Answer]:
        return [self._agreement.weighed((look.key, look.question), answers[0]), *answers[1:]]

    def _still_tells(self, pending: PendingQuestion[Sent]) -> bool:
        key = pending.subject.look.key
        track, heard = self.tracks.get(key), self.backend_tracks.get(key)
        if track is None or pending.stamp_ns < track.first_ns:
            return False
        if track.kind not in CHANGING or pending.subject.probe is not None:
            return True
        overtaken = heard is not None and pending.stamp_ns <= heard.seen_ns and heard.evidence.frames > 0
        return not overtaken and track.seen_ns - pending.stamp_ns <= CHANGES_NS

    def _forget_changed(self, now_ns: int) -> None:
        for key, heard in list(self.backend_tracks.items()):
            if heard.kind in CHANGING and now_ns - heard.seen_ns > CHANGES_NS:
                del self.backend_tracks[key]

    def _looks(self, sighting: Sighting, boxes: Sequence[Box], picture: Picture) -> list[Look]:
        self._picture = picture
        return super()._looks(sighting, boxes, picture)

    def _consult(self, looks: Sequence[Look], question: str, stamp_ns: int) -> None:
        """Send the looks off, in larger pictures than the sign reader's."""
        if (picture := self._picture) is not None:
            for look in looks:
                self._send((look.key, question), stamp_ns, partial(_views, picture, look), Sent(look))

    def _try(self, probe: Probe, look: Look) -> None:
        """Send a probe off."""
        self._send(("probe",), self._seeing_ns, lambda: [enlarged(probe.image)], Sent(look, probe))

    def _send(
        self, topic: tuple[object, ...], stamp_ns: int, images: Callable[[], Sequence[Picture]], sent: Sent
    ) -> None:
        self.worker.send(
            PendingQuestion(topic=topic, stamp_ns=stamp_ns, images=images, question=sent.look.question, subject=sent)
        )


def _views(picture: Picture, look: Look) -> list[Picture]:
    """One for the look and one for its closer look, if it has one; none where one of them cannot be cut out."""
    region = look.shown.region
    regions = (region,) if look.closer is None else (region, plates.ring(region))
    images = [image for each in regions if (image := view(picture, each)) is not None]
    return images if len(images) == len(regions) else []
