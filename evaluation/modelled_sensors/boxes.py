"""What a detector would find in a picture of what is so: boxes with scores and ranges, and some of nothing."""

import math
from bisect import bisect_right
from dataclasses import replace
from statistics import median
from typing import NamedTuple

from evaluation.corruption.chance import chance
from evaluation.modelled_sensors.card import (
    HALF_HIDDEN,
    NEAREST_GHOST_M,
    SPREADS,
    Card,
    Finding,
    Ghost,
    GhostBox,
    Ranging,
    own_odds,
    pace_of,
    regime_of,
    surroundings_of,
)
from evaluation.modelled_sensors.looks import LEAST_PX, air_of, row_of
from evaluation.modelled_sensors.noise import Chain, Drift, chance_of, normal
from evaluation.modelled_sensors.sight import Lens, Thing, things
from evaluation.modelled_sensors.swept import swept
from evaluation.modelled_sensors.way import Way, recorded_ways
from proto.perception import ObjectClass
from proto.sensors import Calibration
from proto.truth import Truth
from services.perception.detect.detection import Detection
from services.perception.pipeline import Perception, Seen
from services.perception.range.box_range import Range, find_range, hiding
from services.perception.range.camera import Camera
from services.simulator.sensors import measurements
from services.simulator.session import CAMERAS

SCORE_FLOORS = {"pedestrian": 0.05}
SCORE_FLOOR = 0.3
"""Of all other classes. Of road users it is where the detector's card has it, held by a test."""
CUT_EDGE_PX, CUT_MEMORY_S = 4.0, 0.3
"""So far inside the picture's edge ends a box that this edge cuts off: the mean of an exponential distribution. In 241 boxes of
vehicles of recorded pictures the median was 1, nine in ten 9, 95 in 100 14 px."""
FAR_M, LIDAR_SIGMA_M = 40.0, (0.15, 0.4)
"""Sigmas of LiDAR ranges up to a distance, and beyond it, where returns are few and tell of no sides."""
SIDE_SIGMA_M, SIDE_MEMORY_S = 0.12, 0.5
"""How well they tell of a road user's sides: so that tracks of vehicles beside come out as far off as in recorded drives."""

FAR_OFF_M = 1e6
"""So far away only the ego's turning moves a thing in the picture."""
SAME_NS = 40_000_000
"""Pictures of a camera come 0.1 s and more apart: so near in age it is the same picture of a box of nothing."""


class Haunting(NamedTuple):
    """A box of nothing that is on."""

    born_ns: int
    born: Way
    ghost: Ghost
    ways: tuple[Way, ...]
    """Where the ego was at each recorded box, from where it was at the first."""
    stood_m: float
    """How far ahead it stood when it came, by the median of its boxes; without any range so far that only turns count."""


class Found(NamedTuple):
    """A detection with its range, as the pipeline has them."""

    detection: Detection
    range: Range | None
    thing: Thing | None = None
    """What it is of; None: of nothing."""


class Eye:
    """One camera with its detector."""

    def __init__(self, card: Card, camera: str, seed: int) -> None:
        self.camera, self._card, self._seed = camera, card, seed
        self.lens = Lens(CAMERAS[camera])
        self.calibration: Calibration = measurements.calibration(CAMERAS[camera])
        self._camera = Camera.of(self.calibration)
        self._chain, self._drift = Chain(seed), Drift(seed)
        self._luck: dict[str, float] = {}
        self._hauntings: list[Haunting] = []
        self._looked_ns, self._way = 0, Way()

    def look(self, truth: Truth, stamp_ns: int) -> list[Found]:
        """What is found in the picture taken then. Pictures come in the order of their stamps."""
        air = air_of(truth)
        detections: list[tuple[Detection, Thing, tuple[float, ...]]] = []
        for thing in things(truth, self.lens):
            finding = self._card.found.get(f"{self.camera}/{thing.kind}")
            if finding is None or thing.height_px < LEAST_PX:
                continue
            row = row_of(thing, air)
            detection = self._detection(thing, finding, row, stamp_ns)
            if detection is not None:
                detections.append((detection, thing, row))
        boxes = [each for each, *_ in detections]
        found = [Found(each, self._range(each, thing, row, stamp_ns, boxes), thing) for each, thing, row in detections]
        return [*found, *self._haunted(truth, stamp_ns)]

    def understood(self, pipeline: Perception, truth: Truth, stamp_ns: int, frame: int) -> Seen:
        """What production makes of what is found in the picture taken then."""
        found = self.look(truth, stamp_ns)
        measured = [
            (each.thing, each.range.depth_m, each.thing.depth_m > FAR_M)
            for each in found
            if each.thing is not None and each.range is not None and each.range.source == "lidar"
            and each.thing.hidden < HALF_HIDDEN
        ]  # fmt: skip
        spec = self.lens.camera
        sweeps = swept(measured, (spec.x_m, spec.y_m), truth.speed_mps, self._seed, self.camera, stamp_ns)
        boxes = [(each.detection, each.detection, each.range) for each in found]
        return pipeline.understood(self.camera, stamp_ns, frame, self._camera, boxes, lidar_used=True, sweeps=sweeps)

    def _detection(self, thing: Thing, finding: Finding, row: tuple[float, ...], stamp_ns: int) -> Detection | None:
        whose = f"{self.camera}/{thing.key}"
        hidden = thing.hidden >= HALF_HIDDEN
        seen, luck = finding.hidden if hidden else finding.seen, self._own("hidden" if hidden else "own", thing.key)
        share = _share(own_odds(seen.odds.at(row), seen.own, luck))
        if not self._chain.at(whose, stamp_ns, share, seen.odds.memory_s):
            return None

        def drawn(what: str) -> float:
            line = getattr(finding, what)
            return float(line.at(row) + line.sigma * self._drift.at(what, whose, stamp_ns, line.memory_s))

        high = thing.height_px * math.exp(drawn("height"))
        wide = (thing.box[2] - thing.box[0]) * high / thing.height_px
        middle = (thing.box[0] + thing.box[2]) / 2 + (
            drawn("aside") * thing.height_px if thing.kind != "light" else 0.0
        )
        foot = thing.box[3] + drawn("foot") * thing.height_px
        score = _share(drawn("score"))
        spec = self.lens.camera
        x0, x1 = max(middle - wide / 2, 0.0), min(middle + wide / 2, float(spec.width_px))
        inside = -CUT_EDGE_PX * math.log(chance_of(self._drift.at("cut", whose, stamp_ns, CUT_MEMORY_S)))
        if thing.box[0] <= 0.0:
            x0 = min(inside, x1)
        elif thing.box[2] >= spec.width_px:
            x1 = max(spec.width_px - inside, x0)
        y0, y1 = max(foot - high, 0.0), min(foot, float(spec.height_px))
        if score < SCORE_FLOORS.get(thing.kind, SCORE_FLOOR) or x1 - x0 < 1.0 or y1 - y0 < 1.0:
            return None
        return Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind=thing.kind, score=score)

    def _own(self, what: str, whose: str) -> float:
        """A standard normal number that is a thing's for good."""
        key = f"{what}/{whose}"
        if key not in self._luck:
            self._luck[key] = normal(self._seed, what, whose)
        return self._luck[key]

    def _range(
        self, found: Detection, thing: Thing, row: tuple[float, ...], stamp_ns: int, others: list[Detection]
    ) -> Range | None:
        ranging, whose = self._card.ranged[f"{self.camera}/{found.kind}"], f"{self.camera}/{thing.key}"
        if ranging.errors and self._chain.at(
            f"lidar/{whose}", stamp_ns, _share(ranging.lidar.at(row)), ranging.lidar.memory_s
        ):
            off = self._off(ranging, thing, whose, stamp_ns)
            far = thing.depth_m > FAR_M
            return Range(
                depth_m=max(0.5, thing.depth_m * (1.0 + off)), sigma_m=LIDAR_SIGMA_M[far], source="lidar", returns=5,
                sides_m=None if far else self._sides(thing, whose, stamp_ns),
            )  # fmt: skip
        return find_range(found, self._camera, None, hiding(found, others))

    def _sides(self, thing: Thing, whose: str, stamp_ns: int) -> tuple[float, float] | None:
        if thing.sides_m is None:
            return None
        off = SIDE_SIGMA_M * self._drift.at("sides", whose, stamp_ns, SIDE_MEMORY_S)
        return thing.sides_m[0] + off, thing.sides_m[1] + off

    def _off(self, ranging: Ranging, thing: Thing, whose: str, stamp_ns: int) -> float:
        """Share by which a measured range is off."""
        regime = regime_of(thing.hidden, thing.cut, thing.full_height_px)
        errors = ranging.errors[regime]
        drift = self._drift.at("range", whose, stamp_ns, errors.memory_s)
        rank = math.sqrt(errors.own) * self._own(f"range/{regime}", whose) + math.sqrt(1.0 - errors.own) * drift
        return _between(rank, errors.quantiles)

    def _haunted(self, truth: Truth, stamp_ns: int) -> list[Found]:
        """Boxes of nothing: each comes by chance, and is what one that was measured in such surroundings at such a speed was.

        As the ego turns, and leaves its line, they move in the picture as what stands by the road does.
        """
        speed_mps, heading_rad = truth.speed_mps, truth.heading_rad or 0.0
        pace = pace_of(speed_mps)
        clutter = self._card.clutter[self.camera][surroundings_of(truth.law_limit_mps)][pace]
        since_s = min((stamp_ns - self._looked_ns) / 1e9, 1.0) if self._looked_ns else 0.0
        self._looked_ns, self._way = stamp_ns, self._way.on(speed_mps * since_s, heading_rad)
        if clutter.ghosts and chance(self._seed, "ghost", self.camera, stamp_ns) < clutter.per_minute / 60.0 * since_s:
            which = int(chance(self._seed, "which", self.camera, stamp_ns) * len(clutter.ghosts))
            ghost = clutter.ghosts[which]
            self._hauntings.append(Haunting(stamp_ns, self._way, ghost, recorded_ways(ghost), self._stood_m(ghost)))
        self._hauntings = [each for each in self._hauntings if self._goes_on(each, stamp_ns, standing=pace == 0)]
        drawn = (self._drawn(each, nth) for each in self._hauntings for nth in self._shown(each, stamp_ns))
        return [found for found in drawn if found is not None]

    def _goes_on(self, haunting: Haunting, stamp_ns: int, *, standing: bool) -> bool:
        """Until its last box; what deceived a moving camera is over when the ego stands, and the other way round."""
        last = haunting.ghost.boxes[-1]
        if standing == haunting.ghost.moving:
            return False
        if standing:
            return stamp_ns - haunting.born_ns <= last.after_s * 1e9 + SAME_NS
        return self._way.driven_m - haunting.born.driven_m <= last.driven_m + last.step_m / 2

    def _shown(self, haunting: Haunting, stamp_ns: int) -> list[int]:
        """Which of its boxes is in this picture, if the recorded one that was as far on its way had one."""
        boxes = haunting.ghost.boxes
        age_ns, driven_m = stamp_ns - haunting.born_ns, self._way.driven_m - haunting.born.driven_m
        if not haunting.ghost.moving:
            return [nth for nth, each in enumerate(boxes) if abs(each.after_s * 1e9 - age_ns) <= SAME_NS]
        near = min(range(len(boxes)), key=lambda nth: abs(boxes[nth].driven_m - driven_m))
        return [near] if abs(boxes[near].driven_m - driven_m) <= boxes[near].step_m / 2 else []

    def _stood_m(self, ghost: Ghost) -> float:
        ranges = ((box, self._ghost_range(self._ghost_box(ghost.kind, box, 0.0), box)) for box in ghost.boxes)
        return median([found.depth_m + box.driven_m for box, found in ranges if found is not None] or [FAR_OFF_M])

    def _ghost_range(self, detection: Detection, ghost: GhostBox) -> Range | None:
        if ghost.range_m is None:
            seen = find_range(detection, self._camera, None)
            return replace(seen, seen_through=ghost.seen_through) if seen is not None else None
        return Range(depth_m=ghost.range_m, sigma_m=LIDAR_SIGMA_M[1], source="lidar", returns=3)

    def _ghost_box(self, kind: ObjectClass, ghost: GhostBox, moved_px: float) -> Detection:
        x0, y0, x1, y1 = ghost.box
        left, right = max(x0 + moved_px, 0.0), min(x1 + moved_px, float(self.lens.camera.width_px))
        return Detection(x0_px=left, y0_px=y0, x1_px=right, y1_px=y1, kind=kind, score=ghost.score)

    def _drawn(self, haunting: Haunting, nth: int) -> Found | None:
        """Its box where what stood there shows from the way that the ego took since, and not from the recorded one; None:
        beyond the picture."""
        ghost = haunting.ghost.boxes[nth]
        moved_px = self._column(haunting, nth) - (ghost.box[0] + ghost.box[2]) / 2
        detection = self._ghost_box(haunting.ghost.kind, ghost, moved_px)
        if detection.x1_px - detection.x0_px < 1.0:
            return None
        return Found(detection, self._ghost_range(detection, ghost))

    def _column(self, haunting: Haunting, nth: int) -> float:
        """Where the middle of its box shows now; what lies behind the camera shows far beyond the picture."""
        box, camera, focal_px = haunting.ghost.boxes[nth], self.lens.camera, self.lens.focal_px
        ahead_m = max(haunting.stood_m - box.driven_m, NEAREST_GHOST_M)
        left_m = ahead_m * (camera.width_px / 2 - (box.box[0] + box.box[2]) / 2) / focal_px
        stood = haunting.ways[nth].place(ahead_m + camera.x_m, left_m)
        ahead_m, left_m = self._way.seen(haunting.born.place(*stood))
        return camera.width_px / 2 - focal_px * left_m / max(ahead_m - camera.x_m, 0.1)


def _between(rank: float, quantiles: tuple[float, ...]) -> float:
    """The quantile at a place among `SPREADS`, evenly between two, held at the ends."""
    k = bisect_right(SPREADS, rank) - 1
    if k < 0 or k == len(SPREADS) - 1:
        return quantiles[k if k > 0 else 0]
    return (quantiles[k + 1] - quantiles[k]) / (SPREADS[k + 1] - SPREADS[k]) * (rank - SPREADS[k]) + quantiles[k]


def _share(odds: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(odds, -30.0), 30.0)))
