"""What the Rules and retrieval services are asked and answer."""

from typing import Annotated, Literal

import msgspec

from proto.scene import Candidate, Scope, Unit

LegalAction = Literal[
    "comply_with_limit", "reduce_speed", "stop", "yield", "proceed", "proceed_with_care", "no_overtaking", "no_entry",
    "none", "unknown",
]  # fmt: skip


VehicleClass = Literal[
    "car", "motorcycle", "van", "car_trailer", "van_trailer", "lorry_light", "lorry", "lorry_trailer", "bus", "coach",
    "car_snow_chains",
]  # fmt: skip
"""Van: goods vehicle up to 3.5 t permissible mass; lorry_light: above 3.5 t up to 7.5 t; lorry: above 7.5 t.

`car_snow_chains` is a car of which `snow_chains` holds.
"""
MonthDay = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])$", description="month and day", examples=["11-15"]
    ),
]


PlaceText = Annotated[
    str, msgspec.Meta(max_length=60, pattern=r"^[^\x00-\x1f\x7f-\x9f{}<>]*$", description="a few plain words")
]


class PlaceName(msgspec.Struct, frozen=True, kw_only=True):
    """How one language names a country, or a part of one. A form that is empty is not known."""

    name: Annotated[PlaceText, msgspec.Meta(min_length=1)]
    """Alone: `Netherlands`."""
    inside: PlaceText = ""
    """`in the Netherlands`."""
    out_of: PlaceText = ""
    """`from the Netherlands`."""
    said: PlaceText = ""
    """In a sentence, where it is not as alone: `the Netherlands`."""

    @property
    def in_a_sentence(self) -> str:
        """`the Netherlands`."""
        return self.said or self.name


class PostedLimit(msgspec.Struct, frozen=True, kw_only=True):
    """A limit as a sign shows it, and how it was seen."""

    value: Annotated[float, msgspec.Meta(ge=0.0, description="number on the sign, in its unit", examples=[80])]
    unit: Annotated[Unit, msgspec.Meta(description="unit of the number on the sign")]
    scope: Annotated[Scope, msgspec.Meta(description="where or when it holds")] = "permanent"
    confidence: Annotated[
        float, msgspec.Meta(ge=0.0, description="probability of the reading, 0 to 1", examples=[0.9])
    ] = 1.0
    plates: Annotated[
        tuple[str, ...], msgspec.Meta(description="plates below it, as read", examples=[["22-06 h"]])
    ] = ()
    reading: Annotated[str, msgspec.Meta(description="sign code as read", examples=["limit:80"])] = ""
    age_s: Annotated[float, msgspec.Meta(description="time since it was passed, s", examples=[12.0])] = 0.0


class Situation(msgspec.Struct, frozen=True, kw_only=True):
    """What Rules need to know of here and now. A field that is absent or null is unknown and never raises a limit.

    Left out, `vehicle_class`, `snow_chains`, `novice`, `standing` and `lit` are the usual case: a car without chains, a driver on a
    full licence, passengers in their seats, no street lamps outside towns. Null says that they are unknown.
    """

    jurisdiction: Annotated[
        str | None, msgspec.Meta(description="country, ISO 3166 alpha-3, or a part of one", examples=["DEU"])
    ] = None
    road_type: Annotated[
        Literal["urban", "rural", "motorway", "dual_carriageway", "living_street", "expressway"] | None,
        msgspec.Meta(description="what kind of road this is"),
    ] = None
    vehicle_class: Annotated[VehicleClass | None, msgspec.Meta(description="class of the vehicle; null: unknown")] = (
        "car"
    )
    posted: Annotated[tuple[PostedLimit, ...], msgspec.Meta(description="limits that signs show here")] = ()
    ended: Annotated[
        tuple[str, ...], msgspec.Meta(description="signs that ended limits", examples=[["limit_end:80"]])
    ] = ()
    wet: Annotated[bool | None, msgspec.Meta(description="the road is wet")] = None
    visibility_m: Annotated[float, msgspec.Meta(ge=0.0, description="how far one sees, m", examples=[150.0])] | None = (
        None
    )
    snow: Annotated[bool | None, msgspec.Meta(description="it snows, or snow lies")] = None
    time_of_day_h: (
        Annotated[float, msgspec.Meta(ge=0.0, le=24.0, description="local time, h", examples=[22.5])] | None
    ) = None
    day: MonthDay | None = None
    zone: (
        Annotated[float, msgspec.Meta(ge=0.0, description="speed of the zone, country's unit", examples=[30])] | None
    ) = None
    road_name: Annotated[str | None, msgspec.Meta(description="number of the road on signs", examples=["A 10"])] = None
    lit: Annotated[bool | None, msgspec.Meta(description="street lamps stand along the road; null: unknown")] = False
    divided: Annotated[bool | None, msgspec.Meta(description="something built separates the two directions")] = None
    snow_chains: Annotated[bool | None, msgspec.Meta(description="chains are on; null: unknown")] = False
    novice: Annotated[bool | None, msgspec.Meta(description="learner or probationary licence; null: unknown")] = False
    electric: Annotated[
        bool | None, msgspec.Meta(description="driven by electricity or a fuel cell alone, and marked so")
    ] = None
    plate_100: Annotated[
        bool | None, msgspec.Meta(description="vehicle or trailer is approved for 100 km/h and bears the plate")
    ] = None
    standing: Annotated[bool | None, msgspec.Meta(description="passengers of a bus stand; null: unknown")] = False
    mass_t: Annotated[float, msgspec.Meta(ge=0.0, description="permissible mass, t", examples=[3.5])] | None = None
    trailer_t: (
        Annotated[float, msgspec.Meta(ge=0.0, description="permissible mass of the trailer, t", examples=[0.75])] | None
    ) = None
    combination_t: (
        Annotated[float, msgspec.Meta(ge=0.0, description="permissible mass of both, t", examples=[4.25])] | None
    ) = None
    segment_id: Annotated[str, msgspec.Meta(description="map segment of the road", examples=["s12"])] = ""
    candidates: Annotated[tuple[Candidate, ...], msgspec.Meta(description="readings of a sign that is in doubt")] = ()
    language: Annotated[str, msgspec.Meta(description="the answer's language", examples=["de"])] = "en"
    home_unit: Annotated[Unit, msgspec.Meta(description="the driver's unit")] = "km/h"


class VehicleFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Facts about car, trailer and driver that limits depend on, constant over a drive. The fields are those of `Situation`."""

    vehicle_class: Annotated[VehicleClass, msgspec.Meta(description="class of the vehicle")] = "car"
    snow_chains: Annotated[bool, msgspec.Meta(description="chains are on")] = False
    novice: Annotated[bool, msgspec.Meta(description="learner or probationary licence")] = False
    electric: Annotated[bool, msgspec.Meta(description="electric or fuel cell alone, and marked so")] = False
    plate_100: Annotated[bool, msgspec.Meta(description="approved for 100 km/h, with the plate")] = False
    standing: Annotated[bool, msgspec.Meta(description="passengers of a bus stand")] = False
    mass_t: Annotated[float, msgspec.Meta(ge=0.0, description="permissible mass, t", examples=[3.5])] | None = None
    trailer_t: (
        Annotated[float, msgspec.Meta(ge=0.0, description="permissible mass of the trailer, t", examples=[0.75])] | None
    ) = None
    combination_t: (
        Annotated[float, msgspec.Meta(ge=0.0, description="permissible mass of both, t", examples=[4.25])] | None
    ) = None


class Citation(msgspec.Struct, frozen=True, kw_only=True):
    """Where an answer stands written: the excerpt equals the document's text between the offsets."""

    document: str
    start: int
    end: int
    excerpt: str
    section: str
    kind: Literal["statute", "sign_table", "guidance"] = "statute"
    provision: str = ""


class CitedParagraph(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of the tool `cited_paragraph`: what stands where a citation points."""

    citation: Citation
    language: str
    rulepack_version: str


class CitablePlaces(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of the tool `citable_places`: packs, a pack's documents, or a document's offsets."""

    places: tuple[str, ...]


class LegalLimit(msgspec.Struct, frozen=True, kw_only=True):
    """A limit as posted beside SI."""

    value: float
    unit: Unit
    mps: float
    advisory: bool = False
    assumed: bool = False
    """No sign, map or place tells that this law holds here: it is shown with a question mark and never spoken as law."""


class RulesAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """`rules_out` of the paper, for limits, lookups and right of way."""

    legal_action: LegalAction
    limit: LegalLimit | None
    citations: tuple[Citation, ...]
    confidence: float
    rulepack_version: str
    """`DEU-v1@1.0.0#<first 12 of the content hash>`"""
    note: str = ""
    minimum: LegalLimit | None = None
    """The speed that the law asks not to go below here, where road, traffic and weather allow it; None: none is known."""
    basis: str = ""
    """`posted`, `gantry`, `zone`, `conditional`, `default`, `advisory`, `lookup`, `unknown`"""
    degraded: tuple[str, ...] = ()
    """What was missing: `retrieval`, `encoder`, `stale_rulepack`, `jurisdiction`."""
    place: PlaceName | None = None
    """Of `applicable_limit`: the country that was asked about, in the language of the question; None: no pack names it."""


class SignMeaning(msgspec.Struct, frozen=True, kw_only=True):
    """What a sign means here, in the driver's language."""

    reading: str
    national_code: str
    meaning: str
    language: str
    legal_action: LegalAction
    limit: LegalLimit | None
    citations: tuple[Citation, ...]
    confidence: float
    rulepack_version: str
    note: str = ""
    binds: tuple[VehicleClass, ...] = ()
    """The classes of vehicle that the sign may bind, where it does not bind all."""


Circumstance = Literal[
    "turning", "turning_left", "turning_cyclists", "entering", "entered_first", "motorway_entry", "lane_change",
    "pulling_out", "obstacle", "single_track", "tram", "school_bus:red", "junction_pedestrians",
]  # fmt: skip
"""What the ego does, or meets, that a law may demand something by; entering: from a property or a road that is no road of its own."""


Light = Literal["red", "red_amber", "amber", "green", "off", "amber_flashing", "flashing_red", "green_arrow"]


class RightOfWayQuestion(msgspec.Struct, frozen=True, kw_only=True):
    """A junction as seen: signs and light that face the ego, what the ego does there, and whether there are other road users."""

    jurisdiction: Annotated[str | None, msgspec.Meta(description="country, ISO 3166 alpha-3", examples=["DEU"])] = None
    signs: Annotated[
        tuple[str, ...], msgspec.Meta(description="codes of the signs that face the ego", examples=[["yield"]])
    ] = ()
    light: Annotated[Light | None, msgspec.Meta(description="light for the ego; green_arrow points the ego's way")] = (
        None
    )
    circumstances: Annotated[
        tuple[Circumstance, ...], msgspec.Meta(description="what the ego does or meets", examples=[["turning_left"]])
    ] = ()
    pedestrians_on_crossing: Annotated[bool | None, msgspec.Meta(description="a person is on the crossing")] = None
    traffic_from_priority_side: Annotated[
        bool | None, msgspec.Meta(description="a vehicle comes from the side that goes first")
    ] = None
    language: Annotated[str, msgspec.Meta(description="the answer's language", examples=["de"])] = "en"


class RulepackInfo(msgspec.Struct, frozen=True, kw_only=True):
    """One loaded rulepack."""

    pack_id: str
    version: str
    content_sha256: str
    jurisdiction: str
    units: Unit
    traffic_side: Literal["left", "right"]
    effective_from: str
    provisions: int
    signs: int
    languages: tuple[str, ...]


class Passage(msgspec.Struct, frozen=True, kw_only=True):
    """A retrieved passage."""

    passage_id: str
    document: str
    start: int
    end: int
    excerpt: str
    section: str
    kind: Literal["statute", "sign_table", "guidance"]
    score: float
    bm25: float
    cosine: float | None
    rulepack_version: str


class Retrieved(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of the tool `retrieve`."""

    passages: tuple[Passage, ...]
    encoder: str
    """The encoder in use, or `bm25-only (loading)` / `bm25-only (not installed)`."""
    lambda_: float
    out_of_scope: bool = False
    """The best passage scores so little that the question is taken to be about something else; no passages are returned then."""
    confidence: float | None = None
    """The probability that the first passage answers; None: not known, as the encoder was not tuned or a reranker chose the first."""
    reranker: str = ""
    """The re-ranker that ordered the passages; or the note that the re-ranker was late and the passages stand as ranked."""
