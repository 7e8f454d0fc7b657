"""The topic table: every topic with its type, rate, maximum age, publishers, and whether it is logged."""

from typing import Generic, Literal, TypeVar

import msgspec

from proto.decision import Advisory, BrakeCommand, Decision, TraceRecord
from proto.health import ChainHead, ServiceHealth, ServiceLog
from proto.perception import Boxes, Lanes, Tracks
from proto.scene import Facts, SceneGraph
from proto.sensors import Calibration, CameraFrame, CanFrames, ClockTick, GnssFix, LidarSweep, MapView, WeatherSensing
from proto.speed_assistance import SpeedAssistance
from proto.tools import CallRecords
from proto.truth import Corrupted, ScenarioState, Truth
from proto.vehicle import Degradation, Ego
from proto.weather import CameraWeather, Conditions
from proto.world import WorldState

M = TypeVar("M", bound=msgspec.Struct)
Encoding = Literal["msgpack", "json"]
Logging = Literal["always", "foxglove_image", "never"]


class Topic(msgspec.Struct, Generic[M], frozen=True, kw_only=True):
    """One row. `name` may hold one `<id>`: a camera, a bus, a service."""

    name: str
    message: type[M]
    rate_hz: float
    """0: on change only; then neither age nor rate is judged."""
    max_age_ms: float
    publishers: tuple[str, ...]
    readers: tuple[str, ...]
    logged: Logging = "always"
    encoding: Encoding = "msgpack"
    keep: Literal["latest", "all"] = "all"
    """What a slow subscriber may lose: `latest` keeps the newest only."""
    droppable: bool = False
    """Large and soon out of date: lost rather than waited for when a link is congested."""
    private: bool = False
    """Never to a guest or the gateway."""

    @property
    def has_id(self) -> bool:
        """Whether the name holds `<id>`."""
        return "<id>" in self.name


_SEEING = ("perception", "drivelm", "logger")
_ALL = ("*",)

CLOCK = Topic(
    name="clock",
    message=ClockTick,
    rate_hz=20,
    max_age_ms=1000,
    publishers=("simulator", "player"),
    readers=_ALL,
    logged="never",
)
CAMERA = Topic(
    name="sensor/camera/<id>",
    message=CameraFrame,
    rate_hz=10,
    max_age_ms=300,
    publishers=("simulator", "player"),
    readers=_SEEING,
    droppable=True,
    logged="foxglove_image",
)
CALIBRATION = Topic(
    name="sensor/calibration/<id>",
    message=Calibration,
    rate_hz=1,
    max_age_ms=5000,
    publishers=("simulator", "player"),
    readers=_SEEING,
)
LIDAR = Topic(
    name="sensor/lidar/<id>",
    message=LidarSweep,
    rate_hz=10,
    max_age_ms=300,
    publishers=("simulator", "player"),
    readers=("perception", "logger"),
    droppable=True,
    logged="never",
    keep="latest",
)
GNSS = Topic(
    name="sensor/gnss",
    message=GnssFix,
    rate_hz=10,
    max_age_ms=500,
    publishers=("simulator", "player"),
    readers=("orchestrator", "drivelm", "logger"),
)
WEATHER_SENSING = Topic(
    name="sensor/weather",
    message=WeatherSensing,
    rate_hz=1,
    max_age_ms=5000,
    publishers=("simulator", "player"),
    readers=("weather", "logger"),
)
MAP = Topic(
    name="sensor/map",
    message=MapView,
    rate_hz=10,
    max_age_ms=500,
    publishers=("simulator",),
    readers=("perception", "drivelm", "orchestrator", "logger"),
    logged="never",
)
CAN_RX = Topic(
    name="can/<id>/rx",
    message=CanFrames,
    rate_hz=20,
    max_age_ms=300,
    publishers=("simulator", "player"),
    readers=("can",),
    logged="never",
    private=True,
)
CAN_TX = Topic(
    name="can/<id>/tx",
    message=CanFrames,
    rate_hz=0,
    max_age_ms=0,
    publishers=("can",),
    readers=("simulator", "logger"),
    private=True,
)
BOXES = Topic(
    name="perception/boxes",
    message=Boxes,
    rate_hz=15,
    max_age_ms=400,
    publishers=("perception",),
    readers=("drivelm", "logger"),
)
TRACKS = Topic(
    name="perception/tracks",
    message=Tracks,
    rate_hz=10,
    max_age_ms=300,
    publishers=("perception",),
    readers=("drivelm", "orchestrator", "arbiter", "logger"),
)
LANES = Topic(
    name="perception/lanes",
    message=Lanes,
    rate_hz=10,
    max_age_ms=500,
    publishers=("perception",),
    readers=("drivelm", "orchestrator", "arbiter", "logger"),
)
CAMERA_WEATHER = Topic(
    name="perception/weather",
    message=CameraWeather,
    rate_hz=1,
    max_age_ms=5000,
    publishers=("perception",),
    readers=("weather", "logger"),
)
FACTS = Topic(
    name="drivelm/facts",
    message=Facts,
    rate_hz=0,
    max_age_ms=0,
    publishers=("drivelm",),
    readers=("orchestrator", "logger"),
)
GRAPH = Topic(
    name="drivelm/graph",
    message=SceneGraph,
    rate_hz=1,
    max_age_ms=5000,
    publishers=("drivelm",),
    readers=("logger",),
    encoding="json",
)
EGO = Topic(
    name="can/ego",
    message=Ego,
    rate_hz=20,
    max_age_ms=200,
    publishers=("can", "player"),
    readers=("perception", "drivelm", "weather", "orchestrator", "arbiter", "logger", "evaluation"),
)
DEGRADATION = Topic(
    name="can/degradation",
    message=Degradation,
    rate_hz=2,
    max_age_ms=2500,
    publishers=("can", "player"),
    readers=("weather", "orchestrator", "arbiter", "logger", "gateway"),
)
CONDITIONS = Topic(
    name="weather/conditions",
    message=Conditions,
    rate_hz=1,
    max_age_ms=5000,
    publishers=("weather",),
    readers=("orchestrator", "arbiter", "logger"),
)
WORLD = Topic(
    name="world_state",
    message=WorldState,
    rate_hz=10,
    max_age_ms=500,
    publishers=("orchestrator",),
    readers=("logger", "can", "gateway"),
    encoding="json",
    logged="never",
)
ADVISORY = Topic(
    name="advisory",
    message=Advisory,
    rate_hz=10,
    max_age_ms=500,
    publishers=("orchestrator",),
    readers=("simulator", "drivelm", "logger", "gateway", "cockpit", "evaluation"),
    encoding="json",
)
SPEED_ASSISTANCE = Topic(
    name="speed_assistance",
    message=SpeedAssistance,
    rate_hz=10,
    max_age_ms=500,
    publishers=("orchestrator",),
    readers=("logger", "gateway", "cockpit", "evaluation"),
    encoding="json",
)
TRACE = Topic(
    name="trace",
    message=TraceRecord,
    rate_hz=10,
    max_age_ms=500,
    publishers=("orchestrator",),
    readers=("logger",),
    encoding="json",
    private=True,
)
DECISION = Topic(
    name="arbiter/decision",
    message=Decision,
    rate_hz=10,
    max_age_ms=500,
    publishers=("arbiter",),
    readers=("logger", "evaluation"),
    encoding="json",
)
BRAKE = Topic(
    name="actuation/brake",
    message=BrakeCommand,
    rate_hz=0,
    max_age_ms=0,
    publishers=("arbiter",),
    readers=("simulator", "logger"),
    private=True,
)
HEALTH = Topic(
    name="health/<id>",
    message=ServiceHealth,
    rate_hz=1,
    max_age_ms=5000,
    publishers=_ALL,
    readers=("logger", "gateway", "cockpit", "evaluation"),
    encoding="json",
    logged="always",
)
CALLS = Topic(
    name="calls/<id>",
    message=CallRecords,
    rate_hz=0,
    max_age_ms=0,
    publishers=_ALL,
    readers=("logger", "evaluation"),
    private=True,
)
LOG = Topic(
    name="log/<id>",
    message=ServiceLog,
    rate_hz=0,
    max_age_ms=0,
    publishers=_ALL,
    readers=("logger",),
    encoding="json",
    private=True,
)
CHAIN = Topic(
    name="logger/chain",
    message=ChainHead,
    rate_hz=0,
    max_age_ms=0,
    publishers=("logger",),
    readers=("gateway", "evaluation"),
    logged="never",
)
SCENARIO = Topic(
    name="scenario",
    message=ScenarioState,
    rate_hz=2,
    max_age_ms=2000,
    publishers=("simulator", "player"),
    readers=("logger", "gateway", "evaluation"),
    encoding="json",
)
TRUTH = Topic(
    name="truth/state",
    message=Truth,
    rate_hz=20,
    max_age_ms=500,
    publishers=("simulator",),
    readers=("evaluation",),
    encoding="json",
    logged="never",
    private=True,
)
CORRUPTED = Topic(
    name="evaluation/corruption/<id>",
    message=Corrupted,
    rate_hz=0,
    max_age_ms=0,
    publishers=("simulator", "player", "perception", "drivelm"),
    readers=("evaluation", "logger"),
    encoding="json",
    private=True,
)
"""What an evaluation did to a drive; the logger only writes it down."""

TOPICS: tuple[Topic[msgspec.Struct], ...] = tuple(
    value for name, value in list(globals().items()) if name.isupper() and isinstance(value, Topic)
)
