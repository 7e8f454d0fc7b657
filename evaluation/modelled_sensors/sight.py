"""What there is for a camera to see, from truth: the things before it as boxes in its picture, and how much hides them.

Truth holds places on the ground and codes, not shapes: heights are those of the simulator's bodies by length, faces are of
usual size, one below the other on their post. Model and fit share this geometry, so what it is off by falls out of both.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from proto.perception import ObjectClass
from proto.truth import TrueActor, Truth
from services.simulator.scene.scene import CameraSpec
from services.simulator.signart import face_size_m
from services.simulator.traffic.cars import EGO_BODY, SIZES_M

POST_TOP_M, PANEL_M, LAMPS_M = 2.5, 5.9, 2.7
"""Heights of middles: of a post's topmost face, of a gantry's panel, of a light's head."""
GAP_M = 0.03
LAMPS_ASIDE_M, LAMP_BEHIND_M, LAMPS_SIZE_M = (("near", 2.4), ("far", 5.6)), 1.0, (0.45, 1.1)
"""Heads stand on both sides of the road, so far beside the nearest lane's middle and behind the line."""
LEFT_HAND = frozenset({"GBR"})
NEAREST_M = 1.5
MOVING_MPS = 1.0
WHOLLY = 0.95
"""Hidden by so much, nothing shows: a car before another leaves no more of it than what boxes are wider than bodies."""
Box4 = tuple[float, float, float, float]
Point = tuple[float, float]
_PERSON_M = SIZES_M["pedestrian"][2]
_HEIGHTS_M = sorted((length, height) for kind, (length, _, height) in SIZES_M.items() if kind != "pedestrian")
PANEL_WIDE_M = 1.2


class Thing(NamedTuple):
    """One thing in a picture. `box` is x0, y0, x1, y1 in pixels, cut at the picture's edges; `depth_m` along the axis."""

    kind: ObjectClass
    key: str
    code: str
    depth_m: float
    box: Box4
    full_height_px: float
    hidden: float = 0.0
    walled: float = 0.0
    """Of `hidden`, what houses hide."""
    cut: float = 0.0
    """Share of the box beyond the picture's edges."""
    sides_m: tuple[float, float] | None = None
    """Of a road user: where it begins and ends to the right of the camera."""
    ahead_mps: float = 0.0
    """How fast it drives the ego's way over ground."""

    @property
    def height_px(self) -> float:
        """Of what lies in the picture."""
        return self.box[3] - self.box[1]


class Lens:
    """A camera's projection of ego-frame points, without turning aside: the simulator's cameras look ahead."""

    def __init__(self, camera: CameraSpec) -> None:
        self.camera = camera
        self._cos, self._sin = math.cos(camera.pitch_rad), math.sin(camera.pitch_rad)
        self.focal_px = camera.focal_px

    def depth_m(self, x_m: float, z_m: float) -> float:
        """Along the camera's axis."""
        return (x_m - self.camera.x_m) * self._cos + (z_m - self.camera.z_m) * self._sin

    def pixel(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float]:
        """Where a point before the camera shows."""
        camera, focal_px, depth = self.camera, self.focal_px, max(self.depth_m(x_m, z_m), 0.3)
        up = (z_m - camera.z_m) * self._cos - (x_m - camera.x_m) * self._sin
        u = camera.width_px / 2 - focal_px * (y_m - camera.y_m) / depth
        return u, camera.height_px / 2 - focal_px * up / depth

    def aside(self, u_px: float, turned_rad: float) -> float:
        """Where what stands at this column shows, so far away that only the turn counts, once the camera turned so far to the left."""
        camera, most = self.camera, math.pi / 2 - 0.1
        right_rad = math.atan((u_px - camera.width_px / 2) / self.focal_px) + turned_rad
        return camera.width_px / 2 + self.focal_px * math.tan(max(-most, min(most, right_rad)))


def turn_rad(before_rad: float, now_rad: float) -> float:
    """From one heading to the other, to the left, by the shorter way."""
    return math.remainder(now_rad - before_rad, math.tau)


def things(truth: Truth, lens: Lens) -> list[Thing]:
    """Everything that shows in the picture, road users first; what hides a thing stands nearer and covers its box.

    A thing that is wholly hidden does not show: a box there is of the thing that hides it.
    """
    users = [thing for actor in truth.actors if (thing := _user(actor, truth, lens)) is not None]
    still = [thing for thing in (*_signs(truth, lens), *_lamps(truth, lens)) if thing is not None]
    seen = (thing._replace(hidden=hidden(thing, users)) for thing in (*users, *still))
    return [thing for thing in seen if thing.hidden < WHOLLY]


def hidden(thing: Thing, users: Sequence[Thing]) -> float:
    """Share of the box that nearer vehicles cover, and of what they leave, what houses hide."""
    x0, y0, x1, y1 = thing.box
    nearer = (each.box for each in users if each.kind == "vehicle" and each.depth_m < thing.depth_m - 0.5)
    parts = [(max(x0, box[0]), max(y0, box[1]), min(x1, box[2]), min(y1, box[3])) for box in nearer]
    covered = _union([part for part in parts if part[0] < part[2] and part[1] < part[3]])
    left = max(0.0, 1.0 - covered / max((x1 - x0) * (y1 - y0), 1e-6))
    return 1.0 - left * (1.0 - thing.walled)


def _union(parts: Sequence[Box4]) -> float:
    """The area of rectangles that may lie on each other: strip by strip between their sides."""
    sides = sorted({side for x0, _, x1, _ in parts for side in (x0, x1)})
    area = 0.0
    for left, right in pairwise(sides):
        reached = -math.inf
        strip = sorted((y0, y1) for x0, y0, x1, y1 in parts if x0 <= left and right <= x1)
        for y0, y1 in strip:
            area += (right - left) * max(y1 - max(y0, reached), 0.0)
            reached = max(reached, y1)
    return area


def body_height_m(actor: TrueActor) -> float:
    """Of the simulator's body that is nearest in length."""
    if actor.kind == "pedestrian":
        return _PERSON_M
    return min(_HEIGHTS_M, key=lambda row: abs(row[0] - actor.length_m))[1]


def _user(actor: TrueActor, truth: Truth, lens: Lens) -> Thing | None:
    speed = actor.vx_mps + truth.speed_mps, actor.vy_mps
    corners = _outline(actor, math.atan2(speed[1], speed[0]) if math.hypot(*speed) > MOVING_MPS else 0.0)
    xs, high = [x for x, _ in corners], body_height_m(actor)
    if max(xs) < NEAREST_M + EGO_BODY.length_m / 2:
        return None
    near_m = max(min(xs), NEAREST_M)
    pixels = [lens.pixel(max(x, NEAREST_M), y, z) for x, y in corners for z in (0, high)]
    depth = lens.depth_m(near_m, lens.camera.z_m)
    kind: ObjectClass = "pedestrian" if actor.kind == "pedestrian" else "vehicle"
    us, vs = [u for u, _ in pixels], [v for _, v in pixels]
    shown = _cut(kind, f"actor/{actor.actor_id}", kind, depth, (min(us), min(vs), max(us), max(vs)), lens.camera)
    if shown is None:
        return None
    across = [lens.camera.y_m - y for _, y in _facing(corners, (lens.camera.x_m, lens.camera.y_m))]
    return shown._replace(sides_m=(min(across), max(across)), ahead_mps=speed[0], walled=actor.walled)


def _outline(actor: TrueActor, heading_rad: float) -> list[Point]:
    """The corners of a body on the ground, counter-clockwise."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    long, wide = actor.length_m / 2, actor.width_m / 2
    own = ((long, -wide), (long, wide), (-long, wide), (-long, -wide))
    return [(actor.x_m + c * x - s * y, actor.y_m + s * x + c * y) for x, y in own]


def _facing(corners: list[Point], eye: Point) -> list[Point]:
    """The corners of the faces that can be seen from a point outside; of a body around it, all."""
    faces = ((p, q) for p, q in pairwise((*corners, corners[0])) if _turn(p, q, eye) < 0.0)
    return [corner for face in faces for corner in face] or corners


def _turn(p: Point, q: Point, at: Point) -> float:
    """Positive where a point lies to the left of the way from p to q."""
    return (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0])


def _signs(truth: Truth, lens: Lens) -> Iterator[Thing | None]:
    for sign in truth.signs:
        number, country, codes = int(float(sign["id"])), str(sign["country"]), str(sign["code"]).split("+")
        panel = codes[0].startswith("led:")
        kind: ObjectClass = "panel" if panel else "sign"
        middle = PANEL_M if panel else POST_TOP_M
        for part, code in enumerate(codes):
            wide, high = face_size_m(country, code)
            if panel:
                wide, high = PANEL_WIDE_M, PANEL_WIDE_M * high / wide
            middle -= high / 2 + GAP_M if part else 0.0
            place = (float(sign["x_m"]), float(sign["y_m"]), middle)
            yield _face(kind, f"sign/{number}/{part}", f"{country} {code}", place, (wide, high), lens)
            middle -= high / 2


def _lamps(truth: Truth, lens: Lens) -> Iterator[Thing | None]:
    if truth.light is None or truth.light_distance_m is None:
        return
    x_m = truth.light_distance_m + EGO_BODY.length_m / 2 + LAMP_BEHIND_M
    line = round(truth.distance_m + truth.light_distance_m, -1)
    near = 1.0 if truth.jurisdiction in LEFT_HAND else -1.0
    for name, aside_m in LAMPS_ASIDE_M:
        place = x_m, near * aside_m if name == "near" else -near * aside_m, LAMPS_M
        yield _face("light", f"light/{line:.0f}/{name}", f" light:{truth.light}", place, LAMPS_SIZE_M, lens)


def _face(
    kind: ObjectClass,
    key: str,
    code: str,
    place: tuple[float, float, float],
    size_m: tuple[float, float],
    lens: Lens,
) -> Thing | None:
    depth = lens.depth_m(place[0], place[2])
    if depth < NEAREST_M:
        return None
    u, v = lens.pixel(*place)
    wide, high = (lens.focal_px * size / depth / 2 for size in size_m)
    return _cut(kind, key, code, depth, (u - wide, v - high, u + wide, v + high), lens.camera)


def _cut(kind: ObjectClass, key: str, code: str, depth: float, box: Box4, camera: CameraSpec) -> Thing | None:
    x0, y0, x1, y1 = box
    inside = max(x0, 0.0), max(y0, 0.0), min(x1, float(camera.width_px)), min(y1, float(camera.height_px))
    if inside[2] - inside[0] < 2.0 or inside[3] - inside[1] < 2.0:
        return None
    share = (inside[2] - inside[0]) * (inside[3] - inside[1]) / max((x1 - x0) * (y1 - y0), 1e-6)
    return Thing(kind, key, code, depth, inside, y1 - y0, cut=1.0 - min(1.0, share))
