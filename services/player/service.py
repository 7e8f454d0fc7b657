"""Publishes a recording's pictures at their own pace, with an assumed calibration where the recording brings none."""

import math
import threading
from pathlib import Path

import cv2

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, UserError
from drivemcp.node import Node
from drivemcp.service import Service
from proto import topics
from proto.sensors import Calibration, CameraFrame
from proto.truth import ScenarioState
from services.player.source import Picture, Recording, open_recording


class PlayerConfig(ServiceConfig, frozen=True, kw_only=True):
    """What to play, how fast, and what to assume of the camera."""

    source: str = ""
    seconds: float = 0.0
    """0: to the end."""
    picture_period_s: float = 0.5
    max_rate_hz: float = 10.0
    fov_deg: float = 60.0
    """Horizontal field of view: an assumption, unless the camera is known. Ranges from the ground plane depend on it."""
    camera_height_m: float = 1.4
    jpeg_quality: int = 90


class Player:
    """Plays one recording on a thread of its own."""

    def __init__(self, config: PlayerConfig, node: Node, recording: Recording) -> None:
        self._config = config
        self._node = node
        self._recording = recording
        self._stop = threading.Event()
        self._at_s = 0.0
        self._finished = False
        self._late = 0
        self._problem = ""
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)

    def start(self) -> None:
        """Begin to play."""
        self._thread.start()

    def close(self) -> None:
        """Stop playing."""
        self._stop.set()
        self._thread.join(3.0)

    def tell(self) -> None:
        """Publish where the recording stands."""
        state = ScenarioState(
            scenario=self._recording.path.name,
            seed=0,
            time_s=self._at_s,
            duration_s=self._recording.duration_s,
            running=not self._finished,
            finished=self._finished,
            late_frames=self._late,
            problem=self._problem,
        )
        self._node.publish(topics.SCENARIO, state)

    def _run(self) -> None:
        start_ns = self._node.clock.now_ns()
        try:
            for number, picture in enumerate(self._recording.pictures):
                due_s = picture.at_s - (self._node.clock.now_ns() - start_ns) / 1e9
                if self._over(picture.at_s) or (due_s > 0 and self._stop.wait(due_s)):
                    break
                self._late += due_s < -1.0 / self._config.max_rate_hz
                self._publish(picture, number)
        except (UserError, cv2.error) as error:
            self._node.log.error("the recording breaks off: %s", error)
            self._problem = str(error)
        self._finished = True

    def _over(self, at_s: float) -> bool:
        return self._stop.is_set() or (self._config.seconds > 0 and at_s > self._config.seconds)

    def _publish(self, picture: Picture, number: int) -> None:
        height, width = picture.bgr.shape[:2]
        if number % 10 == 0:
            self._node.publish(topics.CALIBRATION, assumed_calibration(self._config, width, height), id="front")
        encoded, jpeg = cv2.imencode(".jpg", picture.bgr, [cv2.IMWRITE_JPEG_QUALITY, self._config.jpeg_quality])
        if not encoded:
            return
        frame = CameraFrame(jpeg=jpeg.tobytes(), width_px=width, height_px=height, frame=number)
        self._node.publish(topics.CAMERA, frame, id="front")
        self._at_s = picture.at_s


def assumed_calibration(config: PlayerConfig, width_px: int, height_px: int) -> Calibration:
    """A level pinhole camera in the middle of the windscreen."""
    focal_px = width_px / 2 / math.tan(math.radians(config.fov_deg) / 2)
    return Calibration(
        fx_px=focal_px, fy_px=focal_px, cx_px=width_px / 2, cy_px=height_px / 2, width_px=width_px, height_px=height_px,
        z_m=config.camera_height_m,
    )  # fmt: skip


def build(config: PlayerConfig, node: Node) -> None:
    """Open the recording and play it. Raises ConfigError when there is none, or in lockstep."""
    if config.lockstep:
        raise ConfigError("a recording is played at its own pace; lockstep is for the simulator")
    if not config.source:
        raise ConfigError("source: which video or folder of pictures to play")
    path = str(Path(config.source).resolve())
    recording = open_recording(path, picture_period_s=config.picture_period_s, max_rate_hz=config.max_rate_hz)
    player = Player(config, node, recording)
    node.detail["source"] = f"{recording.path.name}, {recording.total} pictures, {config.fov_deg:g} degrees assumed"
    node.every(0.5, player.tell)
    node.on_close(player.close)
    node.run_soon(player.start)


SERVICE = Service("player", PlayerConfig, build)
