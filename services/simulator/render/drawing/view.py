"""A camera in the world: where it stands, its clip matrix, what it can see, where points fall in its picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.simulator.scene.scene import CameraSpec, Pose

Floats = NDArray[np.float64]
NEAR_M, FAR_M = 0.25, 1500.0


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """``axes`` rows are the camera's right, down and forward in the world (OpenCV's x, y, z)."""

    spec: CameraSpec
    eye: Floats
    axes: Floats

    @staticmethod
    def of(spec: CameraSpec, ego: Pose) -> View:
        """The camera mounted on an ego at this pose."""
        c, s = math.cos(ego.yaw_rad), math.sin(ego.yaw_rad)
        eye = np.array(
            [ego.x_m + c * spec.x_m - s * spec.y_m, ego.y_m + s * spec.x_m + c * spec.y_m, ego.z_m + spec.z_m]
        )
        cp, sp = math.cos(spec.pitch_rad), math.sin(spec.pitch_rad)
        right, forward = np.array([s, -c, 0.0]), np.array([c * cp, s * cp, sp])
        return View(spec, eye, np.stack([right, -np.cross(right, forward), forward]))

    def clip_matrix(self) -> Floats:
        """World to OpenGL clip space, 4 x 4, column-vector convention."""
        f = self.spec.focal_px
        a, b = 2 * f / self.spec.width_px, 2 * f / self.spec.height_px
        depth, shift = (FAR_M + NEAR_M) / (FAR_M - NEAR_M), -2 * FAR_M * NEAR_M / (FAR_M - NEAR_M)
        project = np.array([[a, 0, 0, 0], [0, -b, 0, 0], [0, 0, depth, shift], [0, 0, 1, 0]])
        world = np.eye(4)
        world[:3, :3], world[:3, 3] = self.axes, -self.axes @ self.eye
        return project @ world

    def camera_points(self, points: Floats) -> Floats:
        """World points (N, 3) in the camera's frame."""
        out: Floats = (points - self.eye) @ self.axes.T
        return out

    def pixels(self, points: Floats) -> Floats:
        """Where world points (N, 3) in front of the camera fall, (N, 2) as u, v."""
        local = self.camera_points(points)
        depth = np.maximum(local[:, 2:], NEAR_M)
        centre = (self.spec.width_px / 2, self.spec.height_px / 2)
        out: Floats = local[:, :2] / depth * self.spec.focal_px + centre
        return out

    def sees(self, centres: Floats, radii: Floats, reach_m: float) -> NDArray[np.bool_]:
        """Which spheres (N, 3), (N,) may touch the picture and lie nearer than ``reach_m``."""
        local = self.camera_points(centres)
        half_u = self.spec.width_px / 2 / self.spec.focal_px
        half_v = self.spec.height_px / 2 / self.spec.focal_px
        ahead = local[:, 2]
        inside_u = np.abs(local[:, 0]) < ahead * half_u + radii * math.hypot(1, half_u)
        inside_v = np.abs(local[:, 1]) < ahead * half_v + radii * math.hypot(1, half_v)
        out: NDArray[np.bool_] = inside_u & inside_v & (ahead > -radii) & (ahead - radii < reach_m)
        return out

    def horizon_ndc(self) -> float:
        """Height of the horizon in the picture, -1 bottom to 1 top."""
        return -math.tan(self.spec.pitch_rad) * self.spec.focal_px / (self.spec.height_px / 2)
