"""How a thing looks in a picture: the features that the fitted lines take, and how far a box lies off it."""

import math

from evaluation.modelled_sensors.card import features
from evaluation.modelled_sensors.sight import Thing
from proto.perception import Box
from proto.truth import Truth

LEAST_PX = 5.0
"""Lower things are not looked for."""
REACH_SHARE, REACH_PX = 0.6, 7.0
"""How far a box's middle may lie from the thing's: in the thing's sizes, and in pixels."""
SIZE_RATIO = 2.2
LIGHT_SIZES = 5.0
"""Truth tells no place of lights beside the road: so many sizes aside they may be."""
SCALE_PX = 20.0
Air = tuple[float, float, float]


def air_of(truth: Truth) -> Air:
    """Darkness, rain and fog as `card.features` has them; none of what truth does not tell."""
    rain = truth.rain_mm_h if truth.rain_mm_h is not None else 0.0
    fog = 1000.0 / max(truth.visibility_m, 100.0) if truth.visibility_m is not None else 0.0
    return float(bool(truth.dark)), min(rain / 10.0, 5.0), min(fog, 5.0)


def row_of(thing: Thing, air: Air) -> tuple[float, ...]:
    """The features of a thing in a picture."""
    return features(math.log(max(thing.full_height_px, 1.0) / SCALE_PX), thing.hidden, thing.cut, air)


def misfit(thing: Thing, box: Box) -> float | None:
    """How badly a box lies on a thing; None: it is of another."""
    wide, high = thing.box[2] - thing.box[0], thing.box[3] - thing.box[1]
    aside_px = REACH_SHARE * wide + REACH_PX + (LIGHT_SIZES * high if thing.kind == "light" else 0.0)
    du = abs((box.x0_px + box.x1_px) - (thing.box[0] + thing.box[2])) / 2 / aside_px
    dv = abs((box.y0_px + box.y1_px) - (thing.box[1] + thing.box[3])) / 2 / (REACH_SHARE * high + REACH_PX)
    ratio = abs(math.log(max(box.y1_px - box.y0_px, 1.0) / high)) / math.log(SIZE_RATIO)
    return du + dv + 0.5 * ratio if max(du, dv, ratio) <= 1.0 else None
