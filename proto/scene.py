"""What the vision-language front end publishes: typed facts and the GVQA graph."""

from typing import Annotated, Any, Literal, get_args

import msgspec

Unit = Literal["km/h", "mph"]
FactKind = Literal["limit", "sign", "light", "jurisdiction", "units", "traffic_side", "road_type", "plate", "message"]
Country = Literal["AUT", "BEL", "CHE", "DEU", "ESP", "FRA", "GBR", "IRL", "ITA", "NLD", "POL", "USA"]
"""ISO 3166 alpha-3 codes of the countries whose signs the reader distinguishes; any other is unknown."""
COUNTRIES: frozenset[str] = frozenset(get_args(Country))
Scope = Literal["permanent", "gantry", "when_wet", "zone", "end", "temporary"]


class Candidate(msgspec.Struct, frozen=True, kw_only=True):
    """One possible reading."""

    reading: Annotated[str, msgspec.Meta(description="sign code as read", examples=["limit:60"])]
    confidence: Annotated[float, msgspec.Meta(ge=0.0, description="probability, 0 to 1", examples=[0.4])]


class Fact(msgspec.Struct, frozen=True, kw_only=True):
    """A typed statement about the road, parsed from what the front end said of a picture.

    `reading` is the sign code of the readers' table (`limit:80`, `stop`, `town_entry`, `led:60`, `limit_end:80`, ...),
    `value` the number on a limit (None: no number), `believed` whether evidence over the track suffices.
    """

    kind: FactKind
    reading: str
    confidence: float
    frame_stamp_ns: int
    track_id: int
    camera: str = ""
    value: float | None = None
    unit: Unit | None = None
    scope: Scope = "permanent"
    believed: bool = True
    distance_m: float | None = None
    lateral_m: float | None = None
    candidates: tuple[Candidate, ...] = ()
    plates: tuple[str, ...] = ()
    text: str = ""
    sentence: str = ""
    lane_id: str = ""
    disc_px: float | None = None
    passed: bool = False
    """The track has left the picture: the sign stands beside or behind the ego now."""
    withdrawn: bool = False
    """A light that was doubted before is more probably none, by later pictures of the same track."""
    assumed: bool = False
    """A setting says so, and no picture yet."""
    grounding: str = ""
    """Why picture, sign reader or map do not bear it out, and its confidence fell; empty: nothing speaks against it."""


class Facts(msgspec.Struct, frozen=True, kw_only=True):
    """Facts of one picture or of a track that ended."""

    facts: tuple[Fact, ...]
    backend: str = ""
    latency_ms: float = 0.0


class SceneObject(msgspec.Struct, frozen=True, kw_only=True):
    """A node of the graph, named as DriveLM names it: `<c1,CAM_FRONT,x,y>`."""

    tag: str
    category: str
    status: str
    description: str
    box_px: tuple[float, float, float, float]
    track_id: int = 0
    carried: dict[str, Any] = {}
    """What a file of DriveLM says of it beside this; empty for what was seen."""
    side: str = ""
    """Where it is from the ego: `front`, `front left`, ...; empty: not known."""
    moving: bool | None = None
    """Whether it moves over ground; None: not known."""
    score: float = 0.0


class QA(msgspec.Struct, frozen=True, kw_only=True):
    """One question and answer of the graph, with the indexes of the questions it rests on."""

    layer: Literal["perception", "prediction", "planning", "behavior"]
    question: str
    answer: str
    score: float
    parents: tuple[int, ...] = ()
    carried: dict[str, Any] = {}
    """What a file of DriveLM says of it beside this; empty for what was seen."""


class SceneGraph(msgspec.Struct, frozen=True, kw_only=True):
    """The GVQA graph of one picture."""

    camera: str
    frame: int
    objects: tuple[SceneObject, ...]
    qa: tuple[QA, ...]
    description: str = ""
    backend: str = ""
    carried: dict[str, Any] = {}
    """What a file of DriveLM says of the frame beside this; empty for what was seen."""
