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
        pattern=r"^(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])$", description="for example 11-15", examples=["11-15"]
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

    value: float
    unit: Unit
    scope: Scope = "permanent"
    confidence: float = 1.0
    plates: tuple[str, ...] = ()
    reading: str = ""
    age_s: float = 0.0


class Situation(msgspec.Struct, frozen=True, kw_only=True):
    """What Rules need to know of here and now. A field that is absent or null is unknown and never raises a limit.

    Left out, `vehicle_class`, `snow_chains`, `novice` and `lit` are the usual case: a car without chains, a driver on a full
    licence, no street lamps outside towns. Null says that they are unknown.
    """

    jurisdiction: Annotated[str | None, msgspec.Meta(description="ISO 3166 alpha-3 code, for example DEU")] = None
    road_type: Literal["urban", "rural", "motorway", "dual_carriageway", "living_street", "expressway"] | None = None
    vehicle_class: VehicleClass | None = "car"
    posted: tuple[PostedLimit, ...] = ()
    ended: tuple[str, ...] = ()
    wet: bool | None = None
    visibility_m: float | None = None
    snow: bool | None = None
    time_of_day_h: float | None = None
    day: MonthDay | None = None
    zone: float | None = None
    road_name: str | None = None
    """As signs number it, for example `A 10`."""
    lit: bool | None = False
    """Street lamps stand along the road."""
    divided: bool | None = None
    """Something built separates the two directions."""
    snow_chains: bool | None = False
    novice: bool | None = False
    """The driver's licence is probationary, or the driver is a learner."""
    electric: bool | None = None
    """Driven by electricity or a fuel cell alone, and marked so as the country asks."""
    plate_100: bool | None = None
    """The vehicle or its trailer is approved for 100 km/h and bears the plate."""
    mass_t: float | None = None
    """Permissible mass in tonnes; so are the next two."""
    trailer_t: float | None = None
    combination_t: float | None = None
    segment_id: str = ""
    candidates: tuple[Candidate, ...] = ()
    language: str = "en"
    home_unit: Unit = "km/h"


class VehicleFacts(msgspec.Struct, frozen=True, kw_only=True):
    """What stays as it is over a drive and limits hang on: the car, its trailer, its driver. The fields are those of `Situation`."""

    vehicle_class: VehicleClass = "car"
    snow_chains: bool = False
    novice: bool = False
    electric: bool = False
    plate_100: bool = False
    mass_t: float | None = None
    trailer_t: float | None = None
    combination_t: float | None = None


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

    jurisdiction: str | None = None
    signs: tuple[str, ...] = ()
    light: Light | None = None
    """`green_arrow`: one that points the ego's way."""
    circumstances: tuple[Circumstance, ...] = ()
    pedestrians_on_crossing: bool | None = None
    traffic_from_priority_side: bool | None = None
    language: str = "en"


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
    """The best passage scores so little that the question is taken to be about something else; there are none then."""
    confidence: float | None = None
    """The probability that the first passage answers; None: not known, as the encoder was not tuned or a reranker chose the first."""
    reranker: str = ""
    """Who put the passages in order after they were ranked, where somebody did; or that it was late, and they stand as ranked."""
