"""drivelm: wires the front end to the bus; nothing is decided here."""

import base64
import hashlib
import time
from typing import Annotated, Literal, TypeVar

import msgspec
import numpy as np

from drivemcp.bus.received import Received
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.inference import chosen
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.pictures import draw_boxes, packed_within
from drivemcp.registry import registered
from drivemcp.service import Service
from proto import topics
from proto.perception import Boxes, Lanes, Tracks
from proto.scene import Fact, Facts, SceneGraph
from proto.sensors import Calibration, CameraFrame, GnssFix
from proto.topics import Topic
from services.drivelm.backends import load
from services.drivelm.backends.backend import EmbeddedBackend
from services.drivelm.backends.config import AnswersConfig, GgufConfig, OpenaiConfig, TransformersConfig
from services.drivelm.cameras import Calibrations, RecentFrames, decoded
from services.drivelm.country.country_belief import CountryBelief, oncoming_cue, seen_to_come
from services.drivelm.country.position import Journey, Placing
from services.drivelm.country.surroundings import surroundings
from services.drivelm.decided import DecidedFrames
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.graph import answering as reader_of_graphs
from services.drivelm.graph.nodes import RecentFacts
from services.drivelm.graph.scene_graph import Seen
from services.drivelm.graph.scene_graph import build as build_graph
from services.drivelm.late_front_end import LateFrontEnd
from services.drivelm.ocr.lettering import Lettering, load_lettering
from services.drivelm.reading.reader import Reader

M = TypeVar("M", bound=msgspec.Struct)
MOST_PICTURE_BYTES = 200_000


class DrivelmConfig(ServiceConfig, frozen=True, kw_only=True):
    """Settings of the front end."""

    backend: str = "embedded"
    """`embedded`, `transformers` or `openai`; beside the latter two the embedded one keeps reading."""
    transformers: TransformersConfig = TransformersConfig()
    openai: OpenaiConfig = OpenaiConfig()
    gguf: GgufConfig = GgufConfig()
    outstanding: Annotated[int, msgspec.Meta(ge=1, le=16)] = 2
    """How many questions are with a slow backend at any time."""
    max_age_s: Annotated[float, msgspec.Meta(gt=0, le=60)] = 4.0
    """Pictures older than this, against the newest, are not asked about any more."""
    model: str = "models/reader.onnx"
    """The sign reader."""
    providers: str = "cpu"
    """Execution providers of ONNX Runtime for the reader, in their order, with commas: cpu, cuda, tensorrt, openvino, coreml."""
    home: str = "DEU"
    """Country assumed until signs tell; a weak prior. Empty: assume nothing."""
    max_reads: int = 8
    """Crops read per picture at most; what the frame's share of the processor allows."""
    graph_camera: str = "front"
    """The camera whose boxes the scene graph is made of."""
    stale_ms: float = 1000.0
    """Boxes older than this give no scene graph."""
    read_names: bool = False
    """Read names of towns on large signs, where `rapidocr` is installed; never in lockstep (a thread's timing)."""
    read_plates: bool = False
    """Read hours, distances and lengths on large plates; else as `read_names`."""
    guard: bool = True
    """Whether what the backend says counts only as far as it is borne out (`grounding.py`). Off: for the evaluation."""
    whole_prompts: bool = False
    """For the evaluation: offer `answer_prompt`, the tool of its Direct methods (entry point `drivemcp.whole_prompts`)."""
    prompt_backend: Literal["", "embedded", "transformers", "openai", "gguf"] = ""
    """The backend that answers whole prompts; empty: `backend`. In lockstep the caller waits for it and counts its time."""
    answers: AnswersConfig = AnswersConfig()


class SceneAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """An answer taken word for word from the scene graph."""

    answer: str
    score: float
    layer: str
    camera: str = ""
    frame: int = 0
    """The picture that was answered from."""
    method: str = "extractive: a sentence of the scene graph, chosen by shared words"


class SceneDescription(msgspec.Struct, frozen=True, kw_only=True):
    """The scene in words, with the graph behind it."""

    description: str
    graph: SceneGraph


class DecidedPicture(msgspec.Struct, frozen=True, kw_only=True):
    """A picture with its boxes drawn, at most 200 kB of JPEG."""

    jpeg_base64: str
    camera: str
    frame: int
    stamp_ns: int


def load_reader(config: DrivelmConfig) -> EmbeddedBackend:
    """The embedded backend of the configuration."""
    path = data(config.model)
    reader = Reader.load(path, chosen(config.providers, "drivelm.providers"))
    return EmbeddedBackend(reader, hashlib.sha256(path.read_bytes()).hexdigest())


def load_front_end(config: DrivelmConfig, node: Node, lettering: Lettering) -> FrontEnd:
    """The front end with the configured backend. Raises ConfigError naming the field that cannot be used."""
    if config.backend == "embedded":
        return FrontEnd(
            load_reader(config), home=config.home, max_reads=config.max_reads, lettering=lettering, guarded=config.guard
        )
    if node.lockstep:
        raise ConfigError(f"drivelm.backend = {config.backend} is not for lockstep: its answers come when they come")
    backend = load.load(config.backend, load.Slow(transformers=config.transformers, openai=config.openai))
    node.detail["prompts"] = backend.prompts
    late = LateFrontEnd(
        backend, load_reader(config), home=config.home, max_reads=config.max_reads, lettering=lettering,
        outstanding=config.outstanding, max_age_s=config.max_age_s, guarded=config.guard,
    )  # fmt: skip
    late.worker.ready = lambda: node.run_soon(late.arrive)
    node.on_close(late.worker.close)
    return late


def build(config: DrivelmConfig, node: Node) -> None:
    """Subscribe, read, publish; offer the two tools."""
    Bindings(config, node)


class Bindings:
    """State of the wiring; the worker thread writes it, tools read the last graph (swapped whole)."""

    def __init__(self, config: DrivelmConfig, node: Node, front_end: FrontEnd | None = None) -> None:
        self.config, self.node = config, node
        self.frames, self.calibrations = RecentFrames(), Calibrations()
        self.refused: set[str] = set()
        """Cameras that sent a calibration with which nothing can be reckoned."""
        free = not node.lockstep
        lettering = load_lettering(names=config.read_names and free, plates=config.read_plates and free)
        node.on_close(lettering.close)
        self.decided = DecidedFrames(self.frames, config.graph_camera)
        self.front_end = front_end or load_front_end(config, node, lettering)
        self.facts = RecentFacts()
        self.boxes: dict[str, tuple[int, Boxes]] = {}
        """The last of each camera, with the stamp of their picture."""
        self.graph: SceneGraph | None = None
        self.placing, self.journey = Placing(), Journey()
        node.detail["backend"] = self.front_end.backend.name
        node.subscribe(topics.CAMERA, self.on_frame)
        node.subscribe(topics.CALIBRATION, self.on_calibration)
        node.subscribe(topics.BOXES, self.on_boxes)
        node.subscribe(topics.TRACKS, self.on_tracks)
        node.subscribe(topics.LANES, self.on_lanes)
        node.subscribe(topics.GNSS, self.on_position)
        node.subscribe(topics.EGO)
        node.subscribe(topics.ADVISORY, lambda message, _: self.decided.decide(message))
        node.every(0.1, self.settle)
        node.every(1.0, self.say_surroundings)
        node.every(1.0, self.say_graph)
        node.tool(deadline_ms=60)(self.ask_scene)
        node.tool(deadline_ms=60)(self.describe_scene)
        node.tool(deadline_ms=250)(self.decided_picture)
        if config.whole_prompts:
            registered("drivemcp.whole_prompts", "answer_prompt", "drivelm.whole_prompts")(self)

    def on_frame(self, message: CameraFrame, info: Received[CameraFrame]) -> None:
        self.calibrations.sized(info.id, message.width_px, message.height_px)
        self.frames.add(info.id, info.stamp_ns, message.jpeg)

    def on_calibration(self, message: Calibration, info: Received[Calibration]) -> None:
        if not self.calibrations.take(info.id, message) and info.id not in self.refused:
            self.refused.add(info.id)
            self.node.log.warning("calibrations of %r with impossible numbers are not used", info.id)

    def on_lanes(self, message: Lanes, info: Received[Lanes]) -> None:
        self.front_end.here = self.front_end.here._replace(
            ego_lane_id=message.ego_lane_id,
            lateral_offset_m=message.lateral_offset_m,
            lane_width_m=max(2.5, message.lane_width_m),
            road_class=message.road_class if message.source == "map" else "",
        )

    def on_boxes(self, message: Boxes, info: Received[Boxes]) -> None:
        started = time.perf_counter()
        self.boxes[message.camera] = info.stamp_ns, message
        self.decided.saw(message, info.stamp_ns)
        sighting = Sighting(
            camera=message.camera,
            stamp_ns=info.stamp_ns,
            boxes=message.boxes,
            open_picture=lambda: self.frames.picture(message.camera, info.stamp_ns),
            calibration=self.calibrations.of(message.camera),
        )
        self.say(self.front_end.see(sighting), info.stamp_ns, (time.perf_counter() - started) * 1e3)

    def on_tracks(self, message: Tracks, info: Received[Tracks]) -> None:
        where = self.front_end.country_belief
        for track in message.tracks:
            if seen_to_come(track, message.ego_speed_used_mps):
                where = where.with_cue(("oncoming", track.track_id), oncoming_cue(track.y_m), "oncoming")
        if where is not self.front_end.country_belief:
            self.front_end.believe(where)

    def on_position(self, message: GnssFix, info: Received[GnssFix]) -> None:
        """Positions that lie in one country for some seconds tell it, whatever signs told; near a border none does.

        Where the car goes on at a place that it cannot have driven to, what signs told of the country before counts no more.
        """
        self.placing = self.placing.after(message, info.stamp_ns)
        self.journey = self.journey.after(message, info.stamp_ns)
        if self.journey.elsewhere:
            self.front_end.believe(CountryBelief.at_home(self.config.home))
        if self.placing.told:
            self.front_end.believe(self.front_end.country_belief.at_position(self.placing.told))

    def settle(self) -> None:
        ego = self._alive(topics.EGO)
        now_ns = self.node.clock.now_ns()
        self.say(self.front_end.settle(now_ns, ego.speed_mps if ego is not None else None), now_ns, 0.0)

    def say(self, facts: tuple[Fact, ...], stamp_ns: int, latency_ms: float) -> None:
        if not facts:
            return
        self.facts.take_in(facts, stamp_ns)
        message = Facts(facts=facts, backend=self.front_end.backend.name, latency_ms=round(latency_ms, 3))
        self.node.publish(topics.FACTS, message, stamp_ns=stamp_ns)

    def say_surroundings(self) -> None:
        now_ns = self.node.clock.now_ns()
        facts = surroundings(self.front_end.country_belief, self.front_end.road_type, now_ns)
        if facts:
            self.node.publish(topics.FACTS, Facts(facts=facts, backend=self.front_end.backend.name), stamp_ns=now_ns)

    def say_graph(self) -> None:
        """The scene as last seen, with its picture's stamp; nothing where the camera has gone silent."""
        now_ns = self.node.clock.now_ns()
        stamp_ns, boxes = self.boxes.get(self.config.graph_camera, (0, None))
        if boxes is None or abs(now_ns - stamp_ns) > self.config.stale_ms * 1e6:
            self.graph = None
            return
        tracks, ego = self._alive(topics.TRACKS), self._alive(topics.EGO)
        seen = Seen(
            camera=boxes.camera,
            frame=boxes.frame,
            boxes=boxes.boxes,
            tracks=tracks.tracks if tracks is not None else (),
            facts=self.facts.at(now_ns),
            ego=ego,
            backend=self.front_end.backend.name,
        )
        self.graph = build_graph(seen)
        self.node.publish(topics.GRAPH, self.graph, stamp_ns=stamp_ns)

    def _alive(self, topic: Topic[M]) -> M | None:
        """The newest message of a topic, unless it has fallen silent."""
        received = self.node.latest(topic)
        return received.message if received is not None and self.node.health(topic).alive else None

    def ask_scene(
        self,
        question: Annotated[
            str,
            msgspec.Meta(
                description="a question about what is seen now", max_length=500, examples=["What is ahead of us?"]
            ),
        ],
    ) -> SceneAnswer:
        """Answer a question about the scene ahead from the scene graph; `method` tells how the answer was found.

        Nothing is composed that the graph does not hold. Where it has no fitting sentence it says so, score 0. Fails where
        the camera or perception has been silent for a second.
        """
        graph = self._graph()
        found = reader_of_graphs.ask(graph, question)
        return SceneAnswer(
            answer=found.text, score=found.score, layer=found.layer, method=found.method, camera=graph.camera, frame=graph.frame
        )  # fmt: skip

    def describe_scene(self) -> SceneDescription:
        """Describe the scene ahead in words, with the graph of objects, questions and answers behind them.

        Fails where the camera or perception has been silent for a second.
        """
        graph = self._graph()
        return SceneDescription(description=graph.description, graph=graph)

    def decided_picture(self, tick: int | None = None, frame: int | None = None) -> DecidedPicture:
        """The picture that a tick was decided on, or that of a number, with its boxes drawn.

        Kept for a second, and in memory for the last messages to the driver.
        """
        found = (
            self.decided.of_tick(tick) if tick is not None else self.decided.of_frame(-1 if frame is None else frame)
        )
        picture = decoded(found.jpeg) if found is not None else None
        if found is None or picture is None:
            raise ToolFailed("no picture of it is kept")
        shown = np.ascontiguousarray(picture[..., ::-1])  # blue first, as OpenCV draws and packs
        draw_boxes(shown, found.boxes)
        jpeg = packed_within(shown, MOST_PICTURE_BYTES)
        return DecidedPicture(
            jpeg_base64=base64.b64encode(jpeg).decode("ascii"),
            camera=found.boxes.camera,
            frame=found.boxes.frame,
            stamp_ns=found.stamp_ns,
        )

    def _graph(self) -> SceneGraph:
        graph = self.graph
        if graph is None:
            raise ToolFailed(
                "nothing was seen within the last second", do="ask again when a camera and perception are running"
            )
        return graph


SERVICE = Service("drivelm", DrivelmConfig, build)
