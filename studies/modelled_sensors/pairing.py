"""Whose box is whose: the boxes of recorded pictures beside the things that truth has there."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from evaluation.modelled_sensors.card import Surroundings, surroundings_of
from evaluation.modelled_sensors.looks import LEAST_PX, Air, air_of, misfit
from evaluation.modelled_sensors.sight import LAMPS_SIZE_M, Lens, Thing, things
from proto.perception import Box
from proto.truth import Truth
from services.perception.range.box_range import STANDING
from services.simulator.session import CAMERAS
from studies.modelled_sensors.recording import Recording

LIGHT_TOLD_M, ACTOR_TOLD_M = 110.0, 110.0
"""Truth tells of no light further away than 120 m, and of no road user beyond 160 m, which a box may put at less."""


class Look(NamedTuple):
    """One thing in one picture, and the box that was found of it."""

    camera: str
    stamp_ns: int
    thing: Thing
    air: Air
    box: Box | None


class Stray(NamedTuple):
    """A box of nothing. A box that takes a motorcyclist for a person does not count."""

    camera: str
    stamp_ns: int
    box: Box
    speed_mps: float
    """Of the ego."""
    heading_rad: float
    """Of the ego."""
    surroundings: Surroundings


def looks(recording: Recording) -> Iterator[tuple[list[Look], list[Stray]]]:
    """Picture by picture."""
    lenses = {name: Lens(camera) for name, camera in CAMERAS.items()}
    truths = dict(recording.truths)
    for stamp_ns, boxes in sorted(recording.boxes, key=lambda row: row[0]):
        truth = truths.get(stamp_ns)
        if truth is None or boxes.camera not in lenses:
            continue
        present = [each for each in things(truth, lenses[boxes.camera]) if each.height_px >= LEAST_PX]
        pairs = pair(present, boxes.boxes)
        air, where = air_of(truth), surroundings_of(truth.law_limit_mps)
        owned = set(pairs.values())
        found = [
            Look(boxes.camera, stamp_ns, thing, air, boxes.boxes[pairs[k]] if k in pairs else None)
            for k, thing in enumerate(present)
        ]
        stray = [
            Stray(boxes.camera, stamp_ns, box, truth.speed_mps, truth.heading_rad or 0.0, where)
            for k, box in enumerate(boxes.boxes)
            if k not in owned
            and not _untold(boxes.camera, box)
            and not any(_is_of(each, box) for each in present)
            and not _is_beside(truth, box)
        ]
        yield found, stray


def _is_of(thing: Thing, box: Box) -> bool:
    """Whether a box that has no thing of its own is a second look at this one: on it, or with half of itself over it. A rider's, as
    of a person, is the motorcycle's."""
    if thing.kind != box.kind and (thing.kind, box.kind) != ("vehicle", "pedestrian"):
        return False
    wide = min(thing.box[2], box.x1_px) - max(thing.box[0], box.x0_px)
    high = min(thing.box[3], box.y1_px) - max(thing.box[1], box.y0_px)
    own = (box.x1_px - box.x0_px) * (box.y1_px - box.y0_px)
    return (thing.kind == box.kind and misfit(thing, box) is not None) or max(wide, 0.0) * max(high, 0.0) > 0.5 * own


def _is_beside(truth: Truth, box: Box) -> bool:
    """Whether a box may be of a road user so near that the model has no thing for it."""
    if box.kind not in STANDING or box.range_m is None or box.range_m > BESIDE_M:
        return False
    return any(abs(each.x_m) < BESIDE_M and abs(each.y_m) < BESIDE_M for each in truth.actors)


BESIDE_M = 6.0


def _untold(camera: str, box: Box) -> bool:
    """Whether it may well be a light or a road user that is too far away for truth to tell of."""
    if box.kind in STANDING:
        return box.range_m is not None and box.range_m > ACTOR_TOLD_M
    spec, high = CAMERAS[camera], box.y1_px - box.y0_px
    return box.kind == "light" and spec.focal_px * LAMPS_SIZE_M[1] / high > LIGHT_TOLD_M


def pair(present: Sequence[Thing], boxes: Sequence[Box]) -> dict[int, int]:
    """Box by thing, as indices; the likeliest first, each once, within a class."""
    costs = sorted(
        (cost, k, j)
        for k, thing in enumerate(present)
        for j, box in enumerate(boxes)
        if thing.kind == box.kind and (cost := misfit(thing, box)) is not None
    )
    pairs: dict[int, int] = {}
    taken: set[int] = set()
    for _, k, j in costs:
        if k not in pairs and j not in taken:
            pairs[k] = j
            taken.add(j)
    return pairs
