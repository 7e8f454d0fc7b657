"""The nodes of the graph: objects with the track or the fact behind them, where they are, and whether they move."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from proto.perception import Box, Track
from proto.scene import Fact, SceneObject
from proto.vehicle import Ego
from services.drivelm.graph import plan_rules
from services.drivelm.graph.tags import points
from services.drivelm.graph.templates import SIDES
from services.drivelm.vocabulary.classes import SENTENCES

CAMERA_TAGS: Mapping[str, str] = {"front": "CAM_FRONT", "tele": "CAM_FRONT_TELE"}
ELEMENT = "Traffic element"
_BESIDE_M = 1.8
"""Half a lane: farther to a side is left or right of the ego, not in front of it."""
_MOST_OBJECTS = 12
# Words in an annotated description of a traffic element, and what they mean to the rules.
_MEANINGS = {
    "red light": "light:red",
    "yellow light": "light:amber",
    "green light": "light:green",
    "no entry": "no_entry",
    "stop sign": "stop",
}


class Seen(NamedTuple):
    """What the graph is built from, all of about one instant."""

    camera: str
    frame: int
    boxes: Sequence[Box] = ()
    tracks: Sequence[Track] = ()
    facts: Sequence[Fact] = ()
    ego: Ego | None = None
    backend: str = ""


class Node(NamedTuple):
    """An object of the graph with what lies behind it."""

    shown: SceneObject
    track: Track | None = None
    fact: Fact | None = None

    @property
    def distance_m(self) -> float:
        """How far ahead; unknown is far."""
        if self.track is not None:
            return self.track.x_m
        return self.fact.distance_m if self.fact is not None and self.fact.distance_m is not None else 1e3

    @property
    def is_known(self) -> bool:
        """Whether a track or a fact tells of it; what a file lists is but named."""
        return self.track is not None or self.fact is not None

    @property
    def urgency(self) -> int:
        """Rank among what to consider; lower is more urgent. What is but named is to be considered."""
        return plan_rules.urgency(self.track, self.fact) if self.is_known else plan_rules.UNSURE

    @property
    def is_light(self) -> bool:
        """Whether it is a traffic light."""
        return self.fact is not None and self.fact.kind == "light"


Answerer = Callable[[Node, Seen], str | None]
"""The answer to one question of an object; None: it is not known."""


def side_of(y_m: float | None) -> str:
    """Where something ahead is, in DriveLM's words; not known is in front."""
    if y_m is None or abs(y_m) < _BESIDE_M:
        return "front"
    return "front left" if y_m > 0 else "front right"


def side_of_tag(tag: str) -> str:
    """The side that an object's camera looks to; empty where its name does not say."""
    found = points(tag)
    side = found[0].camera.removeprefix("CAM_").replace("_", " ").lower() if found else ""
    return side if side in SIDES else ""


def seen_nodes(seen: Seen) -> list[Node]:
    """Nodes of what is tracked, read, or found to be read, nearest first."""
    tracks = {track.track_id: track for track in seen.tracks}
    mine = [fact for fact in seen.facts if fact.camera in ("", seen.camera) and fact.kind != "jurisdiction"]
    facts = {fact.track_id: fact for fact in mine if fact.track_id}
    found = []
    for box in seen.boxes:
        is_actor = box.kind in ("vehicle", "pedestrian")
        track, fact = (tracks.get(box.track_id), None) if is_actor else (None, facts.get(box.track_id) or _unread(box))
        if box.track_id and (track is not None or fact is not None):
            found.append((box, track, fact))
    found.sort(key=lambda row: row[1].x_m if row[1] else (row[2].distance_m or 1e3) if row[2] else 1e3)
    return [_node(number, *row, seen) for number, row in enumerate(found[:_MOST_OBJECTS], 1)]


def _unread(box: Box) -> Fact:
    """A traffic element that was found and is not read yet."""
    return Fact(
        kind="light" if box.kind == "light" else "sign",
        reading="",
        confidence=box.score,
        frame_stamp_ns=0,
        track_id=box.track_id,
        believed=False,
        distance_m=box.range_m,
    )


def _node(number: int, box: Box, track: Track | None, fact: Fact | None, seen: Seen) -> Node:
    x, y = (box.x0_px + box.x1_px) / 2, (box.y0_px + box.y1_px) / 2
    source = track or fact
    y_m = track.y_m if track is not None else fact.lateral_m if fact is not None else None
    shown = SceneObject(
        tag=f"<c{number},{CAMERA_TAGS.get(seen.camera, 'CAM_' + seen.camera.upper())},{x:.1f},{y:.1f}>",
        category=ELEMENT if track is None else track.kind.capitalize(),
        status="" if track is None else plan_rules.status(track),
        description=_looks(track, fact),
        box_px=(box.x0_px, box.y0_px, box.x1_px, box.y1_px),
        track_id=box.track_id,
        side=side_of(y_m),
        moving=None if track is None else plan_rules.moves(track, seen.ego),
        score=round(source.confidence, 4) if source is not None else 0.0,
    )
    return Node(shown, track, fact)


def _looks(track: Track | None, fact: Fact | None) -> str:
    if track is not None:
        return f"{track.kind.capitalize()}."
    if fact is None:
        return ""
    if not fact.believed:
        return f"Traffic {'light' if fact.kind == 'light' else 'sign'} that is not read with certainty."
    return SENTENCES.get(fact.reading, fact.sentence) or "Traffic element."


def listed_nodes(objects: Sequence[SceneObject]) -> list[Node]:
    """Nodes of objects alone, as a file lists them: no track behind them, and of traffic elements what their words say."""
    return [Node(shown, None, _fact_in_words(shown)) for shown in objects]


def _fact_in_words(shown: SceneObject) -> Fact | None:
    said = shown.description.strip(" .").lower()
    if shown.category != ELEMENT:
        return None
    reading = _MEANINGS.get(said, "")
    return Fact(
        kind="light" if reading.startswith("light:") else "sign",
        reading=reading,
        confidence=shown.score,
        frame_stamp_ns=0,
        track_id=shown.track_id,
        believed=bool(reading),
        sentence=shown.description,
    )


RECENT_NS = 2_000_000_000


class RecentFacts:
    """The last fact of each track, by its camera and number; withdrawn and older facts are left out."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, int], tuple[int, Fact]] = {}

    def take_in(self, facts: Sequence[Fact], stamp_ns: int) -> None:
        """Facts said at a time."""
        for fact in facts:
            self._last[fact.camera, fact.track_id] = (stamp_ns, fact)

    def at(self, now_ns: int) -> tuple[Fact, ...]:
        """Those that still hold."""
        self._last = {key: row for key, row in self._last.items() if now_ns - row[0] < RECENT_NS}
        return tuple(fact for _, fact in self._last.values() if not fact.withdrawn)
