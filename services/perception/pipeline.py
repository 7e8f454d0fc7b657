"""From pictures to boxes, tracks and lanes, over time; knows no bus and no wall clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np

from proto.perception import Box, Boxes, Lanes, ObjectClass, Track, Tracks
from proto.sensors import Calibration, CameraFrame, LidarSweep, MapView
from proto.vehicle import Ego
from services.perception.checks.decoding import Malformed, open_picture, open_sweep
from services.perception.checks.doubtful_boxes import DOUBTED_SHARE, doubted, in_view, left_to_another, rides
from services.perception.checks.freshness import DeadPictures, Stamps
from services.perception.detect.detection import Detection
from services.perception.detect.detector import Detector
from services.perception.lanes.lead_vehicle import lead_of, place
from services.perception.lanes.model import lane_model
from services.perception.range.box_range import ProjectedSweep, Range, find_range, hiding
from services.perception.range.camera import Camera, Floats
from services.perception.range.levelling import Levelling
from services.perception.range.road_flow import Image, RoadFlow
from services.perception.track.image_tracks import Approach, ImageTracker
from services.perception.track.lidar_motion import ACROSS_SIGMA_MPS, LidarMotion
from services.perception.track.road_user import EgoState, Sighting
from services.perception.track.sightings import Lag, distance_m, sighting_of
from services.perception.track.sweep_speed import Sweeps, turned
from services.perception.track.tracker import Tracker

FRONT = "front"
PRIMARY_WAIT_NS = 1_000_000_000
"""On a rig without a front camera the tracks come with the next camera by name; one silent for so long is passed over."""
OTHERS_WAIT_NS = 300_000_000
"""Of another camera, a picture younger than this says what it would see now."""
BODY_UP_M = 0.8
"""Where a road user's middle is above the road."""
ASIDE_M = 8.0
"""Further aside than this no road user is in our lanes."""
STILL: frozenset[ObjectClass] = frozenset({"sign", "panel", "light"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Ages:
    """How old the latest sweep, ego and map may be beside a picture; older ones count as absent."""

    lidar_ns: int = 300_000_000
    ego_ns: int = 200_000_000
    map_ns: int = 500_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """What one picture gave; tracks and lanes only with the primary camera's pictures."""

    boxes: Boxes
    tracks: Tracks | None = None
    lanes: Lanes | None = None


@dataclass(slots=True)
class Perception:
    """Give it what comes, in the order in which it comes; `see` answers for each picture.

    Pictures, sweeps and calibrations that cannot be read are refused with Malformed or dropped; nothing else raises.
    """

    detector: Detector
    ages: Ages = field(default_factory=Ages)
    tracker: Tracker = field(default_factory=Tracker)
    _cameras: dict[str, Camera] = field(default_factory=dict)
    _has_front: bool = False
    """A front camera was heard of: where it is silent, another camera's narrower view must not pass for its own."""
    _seen_ns: dict[str, int] = field(default_factory=dict)
    _stamps: Stamps = field(default_factory=Stamps)
    _dead: DeadPictures = field(default_factory=DeadPictures)
    _levellings: dict[str, Levelling] = field(default_factory=dict)
    roads: dict[str, RoadFlow] = field(default_factory=dict)
    """Of each camera whose field of view was not given, what the road taught of it."""
    _stills: dict[str, ImageTracker] = field(default_factory=dict)
    _sweep: tuple[int, Floats] | None = None
    _sweep_before: tuple[int, Floats] | None = None
    _by_lidar: LidarMotion = field(default_factory=LidarMotion)
    _movers: tuple[int, tuple[Sighting, ...]] = 0, ()
    """In the sweep of that instant, until they were taken in."""
    _ego: tuple[int, Ego] | None = None
    _map: tuple[int, MapView] | None = None

    def calibrate(self, camera_id: str, calibration: Calibration) -> None:
        """Take a camera's calibration. Raises Malformed where it cannot be worked with."""
        self._has_front |= camera_id == FRONT
        known = self._cameras.get(camera_id)
        if known is not None and known.calibration == calibration:
            return
        camera = Camera.of(calibration, assumed=calibration.assumed)
        if not camera.usable():
            raise Malformed(f"the calibration of {camera_id!r} holds impossible numbers")
        self._cameras[camera_id] = camera

    def sweep(self, stamp_ns: int, sweep: LidarSweep) -> None:
        """Take a LiDAR sweep. Raises Malformed."""
        points = open_sweep(sweep)
        self._sweep_before, self._sweep = self._sweep, (stamp_ns, points)
        self._take_movers(stamp_ns, points)

    def movers(self, stamp_ns: int, sweep: LidarSweep) -> None:
        """From a LiDAR sweep take only the vehicles that move, where all ranges come from elsewhere. Raises Malformed."""
        self._take_movers(stamp_ns, open_sweep(sweep))

    def _take_movers(self, stamp_ns: int, points: Floats) -> None:
        self._movers = stamp_ns, self._by_lidar.step(stamp_ns, points, self._ego_state(stamp_ns))

    def ego(self, stamp_ns: int, ego: Ego) -> None:
        """Take the ego's motion."""
        self._ego = (stamp_ns, ego)

    def map(self, stamp_ns: int, view: MapView) -> None:
        """Take what the map shows around the ego."""
        self._map = (stamp_ns, view)

    def calibrated(self, camera_id: str) -> bool:
        """Whether a measured calibration of this camera came; else a usual dashcam is assumed."""
        known = self._cameras.get(camera_id)
        return known is not None and not known.calibration.assumed

    def measured(self, camera_id: str, frame: CameraFrame) -> Camera | None:
        """The camera for pictures of this size, where its calibration was measured."""
        return self._camera(camera_id, frame) if self.calibrated(camera_id) else None

    def see(self, camera_id: str, stamp_ns: int, frame: CameraFrame, *, closer: bool = True) -> Seen:
        """Boxes of a picture, and with the primary camera's the tracks and lanes. Raises Malformed, also where it tells nothing.

        `closer`: the strip about the horizon of a wide camera's picture is looked at once more, enlarged; it takes twice as long.
        """
        self._has_front |= camera_id == FRONT
        picture = open_picture(frame)
        self._check_stamp(camera_id, stamp_ns)
        self._dead.check(camera_id, frame.jpeg, picture, self._ego_state(stamp_ns).speed_mps)
        camera = self._camera(camera_id, frame)
        found = self.detector.detect(picture, closer=closer and camera.is_wide())
        camera = self._levelled(camera_id, stamp_ns, picture, found, camera)
        points = self._points(stamp_ns)
        sweep = ProjectedSweep.of(points, camera) if points is not None else None
        straight = [camera.straight(detection) for detection in found]
        ranges = [find_range(each, camera, sweep, hiding(each, straight)) for each in straight]
        return self.understood(
            camera_id,
            stamp_ns,
            frame.frame,
            camera,
            list(zip(found, straight, ranges, strict=True)),
            lidar_used=sweep is not None,
        )

    def understood(
        self,
        camera_id: str,
        stamp_ns: int,
        frame: int,
        camera: Camera,
        found: Sequence[tuple[Detection, Detection, Range | None]],
        *,
        lidar_used: bool,
        sweeps: Sweeps | None = None,
    ) -> Seen:
        """What follows from a picture's detections (as found, and undistorted) with their ranges.

        `sweeps`: the last two, where they are not those that were taken.
        """
        self._seen_ns[camera_id] = stamp_ns
        straight, ranges = [each for _, each, _ in found], [each for *_, each in found]
        others = self._others(camera_id, stamp_ns)
        weighed = [
            replace(each, score=DOUBTED_SHARE * each.score) if doubted(each, far, camera, others) else each
            for each, far in zip(straight, ranges, strict=True)
        ]
        owners = self._owners(camera_id, stamp_ns, weighed, ranges, camera, sweeps or self._sweeps(stamp_ns))
        boxes = Boxes(
            camera=camera_id,
            frame=frame,
            boxes=tuple(
                _box(seen, each, far, owner, camera) for (seen, each, far), owner in zip(found, owners, strict=True)
            ),
            detector=self.detector.name,
        )
        if camera_id != self._primary(stamp_ns):
            return Seen(boxes=boxes)
        spread = camera.calibration.focal_spread
        tracks, lanes = self._snapshot(camera_id, stamp_ns, frame, spread, lidar_used=lidar_used)
        return Seen(boxes=boxes, tracks=tracks, lanes=lanes)

    def _check_stamp(self, camera_id: str, stamp_ns: int) -> None:
        beside_ns = [latest[0] for latest in (self._ego, self._sweep) if latest is not None]
        leader = FRONT if self._has_front else min((camera_id, *self._seen_ns))
        if not self._stamps.believed(camera_id, stamp_ns, beside_ns, leads=camera_id == leader):
            raise Malformed(f"a picture of {camera_id!r} at {stamp_ns} ns, far from what all other sources say")

    def _camera(self, camera_id: str, frame: CameraFrame) -> Camera:
        known = self._cameras.get(camera_id)
        if known is None:
            return Camera.assumed(frame.width_px, frame.height_px)
        return known.scaled(frame.width_px, frame.height_px)

    def _levelled(
        self, camera_id: str, stamp_ns: int, picture: Image, found: Sequence[Detection], camera: Camera
    ) -> Camera:
        """A calibrated camera as it is; of another, its pitch and a field of view that was not given, as its pictures teach them."""
        if self.calibrated(camera_id):
            return camera
        levelling = self._levellings.setdefault(camera_id, Levelling())
        levelling.learn(found, camera)
        if not camera.calibration.focal_spread:
            return levelling.apply(camera)
        road = self.roads.setdefault(camera_id, RoadFlow())
        road.learn(stamp_ns, picture, found, self._ego_state(stamp_ns).speed_mps, camera)
        return road.apply(levelling.apply(camera))

    def _primary(self, stamp_ns: int) -> str:
        if self._has_front:
            return FRONT
        fresh = [name for name, seen_ns in self._seen_ns.items() if abs(stamp_ns - seen_ns) < PRIMARY_WAIT_NS]
        return min(fresh)

    def _others(self, camera_id: str, stamp_ns: int) -> list[Camera]:
        """The other calibrated cameras whose pictures still come."""
        fresh = (name for name, seen_ns in self._seen_ns.items() if abs(stamp_ns - seen_ns) < OTHERS_WAIT_NS)
        return [self._cameras[name] for name in fresh if name != camera_id and self.calibrated(name)]

    def _points(self, stamp_ns: int) -> Floats | None:
        """The latest sweep as standing things would give it now: the ego has moved on and turned since."""
        if self._sweep is None or abs(stamp_ns - self._sweep[0]) > self.ages.lidar_ns:
            return None
        points = self._sweep[1].copy()
        points[:, 0] -= self._moved_m(stamp_ns)
        yaw_rate_radps = self._ego_state(stamp_ns).yaw_rate_radps or 0.0
        return turned(points, -yaw_rate_radps * (stamp_ns - self._sweep[0]) / 1e9)

    def _moved_m(self, stamp_ns: int) -> float:
        """How far the ego came since the sweep; 0 where its speed is unknown."""
        speed_mps = self._ego_state(stamp_ns).speed_mps or 0.0
        return speed_mps * (stamp_ns - self._sweep[0]) / 1e9 if self._sweep is not None else 0.0

    def _sweeps(self, stamp_ns: int) -> Sweeps | None:
        """The last two sweeps; None where there are no two."""
        if self._sweep is None or self._sweep_before is None:
            return None
        (latest_ns, latest), (before_ns, before) = self._sweep, self._sweep_before
        turned_rad = (self._ego_state(stamp_ns).yaw_rate_radps or 0.0) * (latest_ns - before_ns) / 1e9
        return Sweeps(latest, before, (stamp_ns - latest_ns) / 1e9, (stamp_ns - before_ns) / 1e9, turned_rad)

    def _ego_state(self, stamp_ns: int) -> EgoState:
        if self._ego is None or abs(stamp_ns - self._ego[0]) > self.ages.ego_ns:
            return EgoState()
        return EgoState(_finite(self._ego[1].speed_mps), _finite(self._ego[1].yaw_rate_radps))

    def _owners(
        self,
        camera_id: str,
        stamp_ns: int,
        detections: Sequence[Detection],
        ranges: Sequence[Range | None],
        camera: Camera,
        sweeps: Sweeps | None,
    ) -> list[int]:
        """Track ids: road users from the ego-frame tracker, what stands still from the camera's own."""
        owners = [0] * len(detections)
        sweep_age_s = (stamp_ns - self._sweep[0]) / 1e9 if self._sweep is not None else 0.0
        lag = Lag(age_s=sweep_age_s, moved_m=self._moved_m(stamp_ns))
        users: list[tuple[int, Sighting]] = []
        others = self._others(camera_id, stamp_ns)
        for index, (detection, found) in enumerate(zip(detections, ranges, strict=True)):
            if found is None or left_to_another(detection, found, camera, others):
                continue
            sighting = sighting_of(detection, found, camera, lag, hiding(detection, detections))
            if sighting is not None:
                users.append((index, sighting))
        bodies = [detections[index] for index, _ in users]
        users = [(index, each) for index, each in users if not rides(detections[index], bodies)]

        def sees(x_m: float, y_m: float) -> bool:
            return in_view(camera, np.array([[x_m, y_m, BODY_UP_M]]))

        sightings = [each for _, each in users]
        if camera_id == self._primary(stamp_ns):
            sightings = self._with_movers(sightings, stamp_ns, sees)
        moving = self.tracker.step(stamp_ns, sightings, self._ego_state(stamp_ns), sees, sweeps)
        for (index, _), owner in zip(users, moving[: len(users)], strict=True):
            owners[index] = owner
        still = [index for index, detection in enumerate(detections) if detection.kind in STILL]
        tracker = self._stills.setdefault(camera_id, ImageTracker(self.tracker.ids))
        ego = self._ego_state(stamp_ns)
        approaches = [_approach(ranges[i], ego.speed_mps, camera) for i in still]
        turn_px_s = (ego.yaw_rate_radps or 0.0) * camera.calibration.fx_px
        standing = tracker.step(stamp_ns, [detections[i] for i in still], approaches, turn_px_s)
        for index, owner in zip(still, standing, strict=True):
            owners[index] = owner
        return owners

    def _with_movers(
        self, seen: Sequence[Sighting], stamp_ns: int, sees: Callable[[float, float], bool]
    ) -> list[Sighting]:
        """What the camera sees, and behind it the movers of the latest sweep that it does not see; each sweep tells once.

        A road user far aside that camera and sweep show is seen to move, and may move across. In our own lanes, where the camera sees them,
        its word counts.
        """
        (swept_ns, movers), self._movers = self._movers, (0, ())
        age_ns = stamp_ns - swept_ns
        if not movers or abs(age_ns) > self.ages.lidar_ns:
            return list(seen)
        told = [
            replace(each, across_sigma_mps=ACROSS_SIGMA_MPS)
            if _aside(each) and any(_close(each, mover) for mover in movers)
            else each
            for each in seen
        ]
        others = (each for each in movers if _aside(each) or not sees(*each.fix.place.tolist()))
        aged = [replace(each, fix=replace(each.fix, age_s=age_ns / 1e9)) for each in others]
        return told + [each for each in aged if not any(_close(each, other) for other in seen)]

    def _snapshot(
        self, camera_id: str, stamp_ns: int, frame: int, spread: float, *, lidar_used: bool
    ) -> tuple[Tracks, Lanes]:
        fresh = self._map is not None and abs(stamp_ns - self._map[0]) <= self.ages.map_ns
        model = lane_model(self._map[1] if self._map is not None and fresh else None)
        ego_mps = self._ego_state(stamp_ns).speed_mps
        placed = [place(in_doubt(track, spread), model, ego_mps) for track in self.tracker.published()]
        tracks = Tracks(
            camera=camera_id,
            frame=frame,
            tracks=tuple(each.track for each in placed),
            lead_track_id=lead_of(placed),
            ego_speed_used_mps=ego_mps,
            lidar_used=lidar_used,
        )
        return tracks, model.message()


def in_doubt(track: Track, spread: float) -> Track:
    """A track of a camera whose focal length is known to this share: an error that all its pictures have in common."""
    sigma_x_m = math.hypot(track.sigma_x_m, spread * track.x_m)
    return msgspec.structs.replace(track, sigma_x_m=sigma_x_m, range_spread=spread) if spread else track


def _aside(sighting: Sighting) -> bool:
    return abs(float(sighting.fix.place[1])) > ASIDE_M


def _close(one: Sighting, other: Sighting) -> bool:
    """Whether both may be of one body."""
    apart = np.abs(one.fix.place - other.fix.place)
    return bool(apart.max() < max(one.body.length_m, other.body.length_m))


def _approach(found: Range | None, speed_mps: float | None, camera: Camera) -> Approach | None:
    """Where standing things drift to as the ego drives straight on: away from where it is heading."""
    if found is None or speed_mps is None:
        return None
    heading, _ = camera.project(camera.eye[None] + np.array([[100.0, 0.0, 0.0]]))
    return Approach(
        growth_per_s=max(0.0, speed_mps) / max(found.depth_m, 3.0), u_px=float(heading[0, 0]), v_px=float(heading[0, 1])
    )


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _box(detection: Detection, straight: Detection, found: Range | None, owner: int, camera: Camera) -> Box:
    return Box(
        x0_px=detection.x0_px,
        y0_px=detection.y0_px,
        x1_px=detection.x1_px,
        y1_px=detection.y1_px,
        kind=detection.kind,
        score=detection.score,
        track_id=owner,
        range_m=distance_m(straight, found, camera) if found is not None else None,
        range_source=found.source if found is not None else "none",
        seen_through=found is not None and found.seen_through,
    )
