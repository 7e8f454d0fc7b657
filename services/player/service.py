"""Publishes a recording's messages at their own pace."""

import threading
from pathlib import Path

import cv2
import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, UserError
from drivemcp.files.can_logs.log import CanLog, check_channel, check_log
from drivemcp.node import Node
from drivemcp.service import Service
from proto import topics
from proto.sensors import CanFrames
from proto.truth import ScenarioState
from services.player.can_log import rebased
from services.player.pictures import webcam_number
from services.player.recording import Options, Recording, TimedMessage
from services.player.source import open_recording, with_track


class PlayerConfig(ServiceConfig, frozen=True, kw_only=True):
    """What to play, how fast, and what to assume of the camera."""

    source: str = ""
    """A video, a folder of pictures, webcam:0, a frame.json or its folder, or a log of ours."""
    seconds: float = 0.0
    """0: to the end."""
    picture_period_s: float = 0.0
    """Time between the pictures of a folder; 0: by the times in their names, else half a second."""
    max_rate_hz: float = 10.0
    """Pictures of a video beyond this rate are skipped."""
    hold_s: float = 3.0
    """How long a single LiDAR frame is shown."""
    fov_deg: float = 0.0
    """Horizontal field of view; 0: not given, 60 degrees are assumed, and ranges are told with the doubt that goes with it."""
    camera_height_m: float = 1.4
    """Height of the camera above the road."""
    can_log: str = ""
    """A log that python-can reads, published as frames of the bus `can0`."""
    can_channel: str = ""
    """Of a log that holds several buses, the one that is published."""
    can_offset_s: float = 0.0
    """The recording starts so long after the CAN log's first frame."""
    track: str = ""
    """A position track (GPX, NMEA, CSV, a video that holds one), published as ego speed and position."""
    track_offset_s: float = 0.0
    """The recording starts so long after the track's first fix, or after the start of the video that holds it."""


class Player:
    """Plays one recording on a thread of its own."""

    def __init__(self, config: PlayerConfig, node: Node, recording: Recording, can_log: CanLog | None = None) -> None:
        self._config = config
        self._node = node
        self._recording = recording
        self._can_log = can_log
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
            scenario=self._recording.name,
            seed=0,
            time_s=self._at_s,
            duration_s=self._recording.duration_s,
            running=not self._finished,
            finished=self._finished,
            late_frames=self._late,
            problem=self._problem if self._finished else "",
        )
        self._node.publish(topics.SCENARIO, state)

    def _run(self) -> None:
        start_ns = self._node.clock.now_ns()
        self._problem = "the player failed; see its log"
        try:
            for each in self._recording.messages:
                due_s = each.at_s - (self._node.clock.now_ns() - start_ns) / 1e9
                if self._over(each.at_s) or (due_s > 0 and self._stop.wait(due_s)):
                    break
                self._publish(each, start_ns, late=due_s < -1.0 / self._config.max_rate_hz)
        except (UserError, cv2.error) as error:
            self._node.log.error("the recording breaks off: %s", error)
            self._problem = str(error)
        else:
            self._problem = ""
        finally:
            self._finished = True
            if self._can_log is not None and self._can_log.summary:
                self._node.log.warning("%s: %s", self._can_log.path.name, self._can_log.summary)

    def _over(self, at_s: float) -> bool:
        return self._stop.is_set() or (self._config.seconds > 0 and at_s > self._config.seconds)

    def _publish(self, timed: TimedMessage, start_ns: int, *, late: bool) -> None:
        """With the stamp it had in the recording, on today's clock: what comes late is known to be old."""
        stamp_ns = start_ns + round(timed.at_s * 1e9)
        self._node.publish(timed.topic, _on_clock(timed.message, start_ns), id=timed.id, stamp_ns=stamp_ns)
        if timed.topic is topics.CAMERA:
            self._late += late
            self._at_s = max(self._at_s, timed.at_s)


def _on_clock(message: msgspec.Struct, start_ns: int) -> msgspec.Struct:
    return rebased(message.frames, start_ns) if isinstance(message, CanFrames) else message


def options_of(config: PlayerConfig) -> Options:
    """What the source needs to know of the configuration."""
    return Options(
        picture_period_s=config.picture_period_s,
        max_rate_hz=config.max_rate_hz,
        hold_s=config.hold_s,
        fov_deg=config.fov_deg,
        camera_height_m=config.camera_height_m,
    )


def build(config: PlayerConfig, node: Node) -> None:
    """Open the recording and play it. Raises ConfigError without a source, or in lockstep."""
    if config.lockstep:
        raise ConfigError("a recording is played at its own pace; lockstep is for the simulator")
    if not config.source:
        raise ConfigError("source: which video, folder of pictures, webcam, frame or log to play")
    source = config.source if webcam_number(config.source) is not None else str(Path(config.source).resolve())
    can_log = CanLog(Path(config.can_log).resolve(), config.can_channel) if config.can_log else None
    if can_log is not None:
        check_log(can_log.path, "can_log")
        check_channel(can_log.path, config.can_channel, "can_channel")
    track = str(Path(config.track).resolve()) if config.track else ""
    recording = open_recording(source, options_of(config), can_log=can_log, can_offset_s=config.can_offset_s)
    recording = with_track(recording, track, config.track_offset_s)
    player = Player(config, node, recording, can_log)
    node.detail["source"] = f"{recording.name}, {recording.pictures or 'live'} pictures: {recording.brings}"
    node.every(0.5, player.tell)
    node.on_close(player.close)
    node.run_soon(player.start)


SERVICE = Service("player", PlayerConfig, build)
