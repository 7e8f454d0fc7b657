"""How many faces of signs and panels were boxed at all, and under how many track ids."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from proto.perception import Boxes
from services.perception.detect.detection import overlaps
from studies.tracking.seeing import Glance
from training.labelling import Label

FACE_PX = 20.0
"""Of the unoccluded face; smaller ones, and those more than a tenth hidden, are not looked for."""
VISIBLE = 0.9
SAME_IOU = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Faces:
    """Faces seen by a camera and those found at least once; of the pictures of all, the share with a box; track ids a face."""

    faces: int
    found: int
    pictures_found: float
    tracks_each: float


def faces(glances: Iterable[Glance]) -> Faces:
    """Over all pictures of a drive; a face is another one for each camera."""
    owners: dict[tuple[str, int, int], list[int | None]] = defaultdict(list)
    for glance in glances:
        for label in glance.look.labels:
            if label.kind in ("sign", "panel") and label.disc_px >= FACE_PX and label.visible_fraction > VISIBLE:
                owners[glance.look.camera, label.id, label.part].append(_track(label, glance.seen.boxes))
    ids = [{track for track in tracks if track is not None} for tracks in owners.values()]
    found = [each for each in ids if each]
    pictures = [track is not None for tracks in owners.values() for track in tracks]
    return Faces(
        faces=len(owners),
        found=len(found),
        pictures_found=sum(pictures) / max(len(pictures), 1),
        tracks_each=sum(map(len, found)) / max(len(found), 1),
    )


def _track(label: Label, boxes: Boxes) -> int | None:
    """The track of the box that lies best on a face; None: none does."""
    mine = [box for box in boxes.boxes if box.kind == label.kind]
    places = np.array([(b.x0_px, b.y0_px, b.x1_px, b.y1_px) for b in mine], np.float32).reshape(-1, 4)
    overlap = overlaps(np.array([label.box_px], np.float32), places)[0]
    return mine[int(overlap.argmax())].track_id if len(mine) and overlap.max() >= SAME_IOU else None
