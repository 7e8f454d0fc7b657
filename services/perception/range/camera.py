"""A calibrated camera: pixels to rays and points to pixels, in the ego frame (x forward, y left, z up)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from domain.cameras import assumed_calibration
from proto.sensors import Calibration
from services.perception.detect.detection import Detection

Floats = NDArray[np.float64]
WIDE_RAD = math.radians(50.0)
PITCH_SIGMA_RAD = math.radians(0.3)
"""Nodding of a car on its springs about the calibrated pitch (our estimate)."""
ASSUMED_PITCH_SIGMA_RAD = math.radians(1.5)
DISTORTION_COUNTS = (0, 4, 5, 8, 12, 14)
"""Of the coefficients that OpenCV's lens models take."""


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """`axes` rows are right, down and forward of the camera in the ego frame; `eye` its place there."""

    calibration: Calibration
    axes: Floats
    eye: Floats
    pitch_sigma_rad: float

    @staticmethod
    def of(calibration: Calibration, *, assumed: bool = False) -> Camera:
        """From a calibration, its pitch positive upwards and its yaw positive to the left."""
        cp, sp = math.cos(calibration.pitch_rad), math.sin(calibration.pitch_rad)
        cy, sy = math.cos(calibration.yaw_rad), math.sin(calibration.yaw_rad)
        forward, right = np.array([cp * cy, cp * sy, sp]), np.array([sy, -cy, 0.0])
        axes = np.stack([right, np.cross(forward, right), forward])
        eye = np.array([calibration.x_m, calibration.y_m, calibration.z_m])
        return Camera(calibration, axes, eye, ASSUMED_PITCH_SIGMA_RAD if assumed else PITCH_SIGMA_RAD)

    @staticmethod
    def assumed(width_px: int, height_px: int) -> Camera:
        """A level camera with a usual field of view, for pictures that come without a calibration."""
        return Camera.of(assumed_calibration(width_px, height_px), assumed=True)

    def usable(self) -> bool:
        """Whether the numbers can be worked with at all."""
        c = self.calibration
        numbers = (c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.x_m, c.y_m, c.z_m, c.pitch_rad, c.yaw_rad, *c.distortion)
        possible = all(map(math.isfinite, numbers)) and min(c.fx_px, c.fy_px, c.z_m, c.width_px, c.height_px) > 0
        possible = possible and 0.0 <= c.focal_spread < 1.0
        return possible and len(c.distortion) in DISTORTION_COUNTS and self._straightens()

    def is_wide(self) -> bool:
        """Whether it sees `WIDE_RAD` and more from side to side: what is far is small in its pictures."""
        return self.calibration.width_px / 2 / self.calibration.fx_px >= math.tan(WIDE_RAD / 2)

    def scaled(self, width_px: int, height_px: int) -> Camera:
        """The same camera for pictures of another size than the calibrated one."""
        c = self.calibration
        if (width_px, height_px) == (c.width_px, c.height_px):
            return self
        u, v = width_px / c.width_px, height_px / c.height_px
        resized = msgspec.structs.replace(
            c,
            fx_px=c.fx_px * u,
            fy_px=c.fy_px * v,
            cx_px=c.cx_px * u,
            cy_px=c.cy_px * v,
            width_px=width_px,
            height_px=height_px,
        )
        return Camera(resized, self.axes, self.eye, self.pitch_sigma_rad)

    def straight(self, detection: Detection) -> Detection:
        """The box as a camera without lens distortion would have seen it."""
        if not any(self.calibration.distortion):
            return detection
        corners = [(detection.x0_px, detection.y0_px), (detection.x1_px, detection.y1_px)]
        (x0, y0), (x1, y1) = self._undistorted(corners).tolist()
        return Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind=detection.kind, score=detection.score)

    def _undistorted(self, pixels: Sequence[tuple[float, float]]) -> Floats:
        """Pixels (N, 2) without the lens's distortion."""
        c = self.calibration
        matrix = np.array([[c.fx_px, 0.0, c.cx_px], [0.0, c.fy_px, c.cy_px], [0.0, 0.0, 1.0]])
        given = np.array(pixels, dtype=np.float64)[:, None]
        return cv2.undistortPoints(given, matrix, np.array(c.distortion), P=matrix)[:, 0].astype(np.float64)

    def _straightens(self) -> bool:
        """Whether the picture's corners and middle, once straight, are still numbers and in their order."""
        width, height = self.calibration.width_px, self.calibration.height_px
        if not any(self.calibration.distortion):
            return True
        corners: list[tuple[float, float]] = [(0, 0), (width, height), (0, height), (width, 0)]
        try:
            pixels = self._undistorted([*corners, (width / 2, height / 2)])
        except cv2.error:
            return False
        left, right, middle = pixels[[0, 2], 0], pixels[[1, 3], 0], pixels[4]
        top, bottom = pixels[[0, 3], 1], pixels[[1, 2], 1]
        in_order = (left < middle[0]).all() and (middle[0] < right).all()
        return bool(np.isfinite(pixels).all() and in_order and (top < middle[1]).all() and (middle[1] < bottom).all())

    def ray(self, u_px: float, v_px: float) -> Floats:
        """Direction (3,) in the ego frame of an undistorted pixel, with length one along the camera's axis."""
        c = self.calibration
        direction: Floats = np.array([(u_px - c.cx_px) / c.fx_px, (v_px - c.cy_px) / c.fy_px, 1.0]) @ self.axes
        return direction

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Undistorted pixels (N, 2) and depths (N,) of ego-frame points (N, 3); pixels count where the depth is positive."""
        c = self.calibration
        local = (points - self.eye) @ self.axes.T
        depth = local[:, 2]
        safe = np.where(depth > 0.1, depth, 0.1)
        pixels = local[:, :2] / safe[:, None] * (c.fx_px, c.fy_px) + (c.cx_px, c.cy_px)
        return pixels, depth
