"""How large things are: priors for ranging by size, and the body a track is given. Our own estimates of common sizes."""

from __future__ import annotations

from dataclasses import dataclass

from proto.perception import ObjectClass


@dataclass(frozen=True, slots=True, kw_only=True)
class SizePrior:
    """Height of a class, the share by which it varies (one sigma), and the heights that are possible at all."""

    height_m: float
    spread: float
    possible_m: tuple[float, float] = (0.0, 100.0)


PRIORS: dict[ObjectClass, SizePrior] = {
    "vehicle": SizePrior(height_m=1.6, spread=0.35, possible_m=(0.9, 4.3)),
    "pedestrian": SizePrior(height_m=1.7, spread=0.12, possible_m=(0.8, 2.3)),
    "sign": SizePrior(height_m=0.65, spread=0.25),
    "panel": SizePrior(height_m=1.2, spread=0.2),
    "light": SizePrior(height_m=0.95, spread=0.2),
}


TALL_VEHICLE = SizePrior(height_m=2.8, spread=0.3, possible_m=(0.9, 4.3))
"""Van, lorry or bus from the front or behind."""
TALL_ASPECTS = (0.62, 0.98)
"""Width by height of such a box; narrower ones are motorcycles, wider ones cars or flanks."""


def prior_of(kind: ObjectClass, width_px: float, height_px: float) -> SizePrior:
    """The prior that suits a box of this class and shape."""
    if kind == "vehicle" and TALL_ASPECTS[0] <= width_px / max(height_px, 1.0) <= TALL_ASPECTS[1]:
        return TALL_VEHICLE
    return PRIORS[kind]


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Length and width over ground."""

    length_m: float
    width_m: float


CAR, VAN, LORRY = Body(length_m=4.5, width_m=1.85), Body(length_m=5.6, width_m=2.0), Body(length_m=9.5, width_m=2.5)
PERSON = Body(length_m=0.5, width_m=0.6)


def body_of(kind: str, height_m: float | None) -> Body:
    """The body of a road user of this measured height (None: unknown); vans from 1.9 m, lorries and buses from 2.7 m."""
    if kind != "vehicle":
        return PERSON
    if height_m is None or height_m < 1.9:
        return CAR
    return VAN if height_m < 2.7 else LORRY
