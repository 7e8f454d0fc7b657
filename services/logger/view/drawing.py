"""Draws log records with Rerun: the same records whether they come live or from an old file."""

import re
from collections.abc import Callable, Mapping
from typing import TypeVar

import msgspec
import rerun as rr
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from proto import topics
from proto.decision import Advisory, Decision
from proto.perception import Boxes, Lanes, Tracks
from proto.scene import Facts
from proto.tools import CallRecords
from proto.topics import Topic
from proto.vehicle import Ego
from services.logger.view.blueprint import blueprint, name_series
from services.logger.view.labels import readable

M = TypeVar("M", bound=msgspec.Struct)
KMH = 3.6
SHORT = {"pedestrian": "person"}
"""Labels that would not fit beside their box."""
_COLORS = {
    "vehicle": (90, 170, 255),
    "pedestrian": (255, 160, 60),
    "cyclist": (255, 160, 60),
    "sign": (240, 80, 80),
    "panel": (240, 200, 60),
    "light": (120, 220, 120),
}
_WHITE = (230, 230, 230)
_LEVELS = {"info": "INFO", "advice": "INFO", "warning": "WARN", "alarm": "ERROR"}
_SHOWN_S = 20.0
"""Times longer than this are drawn at this: far from any risk, and the curve stays readable."""
_READINGS_KEPT = 200


class Drawing:
    """Turns records into what the viewer shows. Records of other topics are passed over."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        self._first_ns: int | None = None
        self._readings: dict[int, str] = {}
        self._said: tuple[str, str] = ("", "")
        self._now = ""
        self._draw: Mapping[str, Callable[[str, bytes], None]] = {
            topics.CAMERA.name: self._picture,
            topics.BOXES.name: _typed(topics.BOXES, self._boxes),
            topics.FACTS.name: _typed(topics.FACTS, self._facts),
            topics.TRACKS.name: _typed(topics.TRACKS, self._tracks),
            topics.LANES.name: _typed(topics.LANES, self._lanes),
            topics.EGO.name: _typed(topics.EGO, self._ego),
            topics.ADVISORY.name: _typed(topics.ADVISORY, self._advisory),
            topics.DECISION.name: _typed(topics.DECISION, self._decision),
            topics.CALLS.name: _typed(topics.CALLS, self._calls),
        }
        stream.send_blueprint(blueprint())
        name_series(stream)
        stream.log("bird/ego", rr.Boxes2D(centers=[[0, 0]], sizes=[[1.8, 4.5]], colors=[_WHITE]), static=True)

    def record(self, topic: str, name: str, stamp_ns: int, data: bytes) -> None:
        """Draws one record: `topic` as the topic table has it, `name` with the id filled in, `data` as logged.

        Raises ValueError on data that do not fit the topic.
        """
        draw = self._draw.get(topic)
        if draw is None:
            return
        if self._first_ns is None:
            self._first_ns = stamp_ns
        self._stream.set_time("drive", duration=(stamp_ns - self._first_ns) / 1e9)
        draw(name, data)

    def _picture(self, name: str, data: bytes) -> None:
        image = CompressedImage.FromString(data)
        camera = name.rsplit("/", 1)[1]
        self._stream.log(f"camera/{camera}", rr.EncodedImage(contents=image.data, media_type="image/jpeg"))

    def _boxes(self, message: Boxes) -> None:
        array = [[box.x0_px, box.y0_px, box.x1_px, box.y1_px] for box in message.boxes]
        told = [self._label(box.kind, box.track_id, box.range_m) for box in message.boxes]
        labels = readable(message.boxes, told)
        colors = [_COLORS.get(box.kind, _WHITE) for box in message.boxes]
        boxes = rr.Boxes2D(array=array, array_format=rr.Box2DFormat.XYXY, labels=labels, colors=colors)
        self._stream.log(f"camera/{message.camera}/boxes", boxes if array else rr.Clear(recursive=False))

    def _label(self, kind: str, track_id: int, range_m: float | None) -> str:
        read = self._readings.get(track_id, "") if kind in ("sign", "panel", "light") else ""
        return " ".join(
            part for part in (read or SHORT.get(kind, kind), "" if range_m is None else f"{range_m:.0f} m") if part
        )

    def _facts(self, message: Facts) -> None:
        for fact in message.facts:
            if fact.track_id:
                mark = "" if fact.believed else "?"
                self._readings.pop(fact.track_id, None)
                if fact.withdrawn:
                    continue
                why = f" ({fact.grounding})" if fact.grounding else ""
                self._readings[fact.track_id] = f"{fact.reading}{mark} {fact.confidence:.2f}{why}"
        while len(self._readings) > _READINGS_KEPT:
            del self._readings[next(iter(self._readings))]

    def _tracks(self, message: Tracks) -> None:
        tracks = message.tracks
        lead = message.lead_track_id
        boxes = rr.Boxes2D(
            centers=[[-track.y_m, -track.x_m] for track in tracks],
            sizes=[[track.width_m, track.length_m] for track in tracks],
            labels=[f"{SHORT.get(track.kind, track.kind)} {track.vx_mps * KMH:+.0f} km/h" for track in tracks],
            colors=[(240, 80, 80) if track.track_id == lead else _COLORS.get(track.kind, _WHITE) for track in tracks],
        )
        self._stream.log("bird/tracks", boxes if tracks else rr.Clear(recursive=False))

    def _lanes(self, message: Lanes) -> None:
        middle = -message.lateral_offset_m
        edges = [middle - message.lane_width_m / 2, middle + message.lane_width_m / 2]
        strips = [[[-y, -100.0], [-y, 15.0]] for y in edges]
        colors = [(110, 110, 110), (110, 110, 110)]
        if message.stop_line_distance_m is not None:
            x = message.stop_line_distance_m
            strips.append([[-edges[0], -x], [-edges[1], -x]])
            colors.append((240, 80, 80))
        self._stream.log("bird/lane", rr.LineStrips2D(strips, colors=colors))

    def _ego(self, message: Ego) -> None:
        if message.speed_mps is not None:
            self._stream.log("speed/ego", rr.Scalars([message.speed_mps * KMH]))

    def _advisory(self, message: Advisory) -> None:
        if message.legal_limit is not None and not message.legal_limit.assumed:
            self._stream.log("speed/limit", rr.Scalars([message.legal_limit.mps * KMH]))
        if message.target_mps is not None:
            self._stream.log("speed/target", rr.Scalars([message.target_mps * KMH]))
        if message.snapshot_to_advice_ms is not None:
            self._stream.log("latency/snapshot_to_advice", rr.Scalars([message.snapshot_to_advice_ms]))
        if message.kind != "SILENT" and message.directive:
            self._message(message)

    def _message(self, message: Advisory) -> None:
        said, now = (message.directive, message.justification), _now(message)
        if said != self._said:
            self._said = said
            text = f"{message.kind}: {message.directive}"
            self._stream.log("messages", rr.TextLog(text, level=_LEVELS.get(message.urgency, "INFO")))
        if now != self._now:
            self._now = now
            self._stream.log("now", rr.TextDocument(now, media_type=rr.MediaType.MARKDOWN))

    def _decision(self, message: Decision) -> None:
        metrics = message.metrics
        terms = {"risk/r": metrics.r, "risk/delta": metrics.delta}
        for entity, value in (("times/ttc_s", metrics.ttc_s), ("times/headway_s", metrics.headway_s)):
            if value is not None:
                terms[entity] = min(value, _SHOWN_S)
        for entity, value in terms.items():
            self._stream.log(entity, rr.Scalars([value]))

    def _calls(self, message: CallRecords) -> None:
        for call in message.records:
            if call.side == "caller":
                elapsed_ms = (call.done_ns - call.sent_ns) / 1e6
                self._stream.log(f"latency/{call.tool}", rr.Scalars([elapsed_ms]))


def _now(message: Advisory) -> str:
    lines = [f"## {literal(message.directive)}", "", literal(message.justification), ""]
    lines += [f"- {literal(one.section)}: {literal(one.excerpt)}" for one in message.citations]
    if message.degraded:
        lines.append("\nMissing or late: " + ", ".join(map(literal, message.degraded)))
    return "\n".join(lines)


def _typed(topic: Topic[M], draw: Callable[[M], None]) -> Callable[[str, bytes], None]:
    decoder = msgspec.json.Decoder(topic.message)
    return lambda _, data: draw(decoder.decode(data))


_PUNCTUATION = re.compile(r"([!-/:-@\[-`{-~])")


def literal(text: str) -> str:
    """One line of Markdown that shows the text, in which a backslash stands before all that Markdown could take for its own."""
    return _PUNCTUATION.sub(r"\\\1", " ".join(text.split()))
