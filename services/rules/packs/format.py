"""The files of a rulepack as Structs: manifest, provisions with typed effects, sign table, test cases."""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from proto.rules import LegalAction, MonthDay, PlaceName, VehicleClass
from proto.scene import Unit

Kind = Literal["statute", "sign_table", "guidance"]
RoadType = Literal["urban", "rural", "motorway", "dual_carriageway", "living_street", "expressway"]
Lane = Literal["left", "middle", "right", "bus", "hard_shoulder"]
Texts = dict[str, str]
"""One text by language code."""
PackId = Annotated[
    str,
    Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9.-]{0,63}$", description="also the name of its folder", examples=["ITA-v1"]),
]
Version = Annotated[str, Meta(pattern=r"^[0-9]+\.[0-9]+\.[0-9]+$", description="semantic version", examples=["1.2.3"])]
Day = Annotated[
    str, Meta(pattern=r"^[0-9]{4}-[0-9]{2}-[0-9]{2}$", description="ISO 8601 date", examples=["2025-01-31"])
]
Place = Annotated[
    str,
    Meta(
        pattern=r"^[A-Z]{3}(-[A-Z0-9]{1,3})?$",
        description="ISO 3166-1 alpha-3, a part as in ISO 3166-2 behind it",
        examples=["ITA", "USA-CA"],
    ),
]
Hash = Annotated[str, Meta(pattern=r"^[0-9a-f]{64}$", description="SHA-256, written by `drivemcp rulepack seal`")]
Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$", examples=["ita-speed-town"])]
Code = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z0-9_]+(:[A-Za-z0-9_.]+){0,3}$",
        description="as the sign readers write it",
        examples=["no_entry", "plate:when_wet"],
    ),
]
Speed = Annotated[float, Meta(gt=0, le=300)]
Offset = Annotated[int, Meta(ge=0, description="characters from the beginning of the document")]
Hour = Annotated[float, Meta(ge=0, le=24)]
Mass = Annotated[float, Meta(gt=0, le=100)]


class Extends(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The pack this one adds to, and the oldest version it was written against."""

    id: PackId
    version: Version


class Manifest(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`manifest.json`."""

    id: PackId
    title: str
    jurisdiction: Place
    version: Version
    content_sha256: Hash
    effective_from: Day
    effective_until: Day | None
    units: Unit
    traffic_side: Literal["left", "right"]
    languages: tuple[str, ...]
    names: Annotated[dict[Place, Annotated[dict[str, PlaceName], Meta(max_length=40)]], Meta(max_length=100)] = {}
    """By place and language: what the country, and each part that is told, is called. Drivers hear no code."""
    precedence: tuple[Kind, ...]
    plausible_limits: dict[RoadType, tuple[Speed, Speed]]
    """Per type of road the lowest and the highest limit, in `units`, that a doubtful reading may be believed to be."""
    extends: Extends | None = None
    base: bool = False
    """Whether no place has this law alone: what the parts of a country share, and the most careful of what differs."""
    disclaimer: str = ""


class When(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """On what an effect depends; an absent field is no condition."""

    road_types: tuple[RoadType, ...] = ()
    vehicle_classes: tuple[VehicleClass, ...] = ()
    wet: bool | None = None
    snow: bool | None = None
    visibility_below_m: Annotated[float, Meta(gt=0)] | None = None
    hours: tuple[Hour, Hour] | None = None
    """Local time of day in hours, from and to; past midnight where the second is smaller."""
    period: tuple[MonthDay, MonthDay] | None = None
    """Days of the year, first and last; over the turn of the year where the second is earlier."""
    roads: tuple[Annotated[str, Meta(max_length=16)], ...] = ()
    """Roads by number, as signs write it: `A 10`."""
    not_roads: tuple[Annotated[str, Meta(pattern=r"^[A-Z]{1,4}$")], ...] = ()
    """Letters before the number of roads on which it does not hold: `US` excepts `US 290`. A road of unknown number may be any."""
    lit: bool | None = None
    divided: bool | None = None
    snow_chains: bool | None = None
    novice: bool | None = None
    electric: bool | None = None
    plate_100: bool | None = None
    standing: bool | None = None
    """Passengers of a bus stand."""
    mass_above_t: Mass | None = None
    """Permissible mass of the vehicle, of its trailer, of both together, in tonnes."""
    trailer_above_t: Mass | None = None
    combination_above_t: Mass | None = None
    lanes: tuple[Lane, ...] = ()
    """No situation says the lane: a limit for one is taken to hold."""
    posted_below: Speed | None = None
    """Only where a sign that is, or may be, in force, and not only when wet, shows less than this, in the pack's `units`."""
    zone: bool | None = None
    """Within a signed speed zone, or outside every one."""
    subdivision: Place | None = None
    """For example `GBR-WLS`; applies only where the jurisdiction is known to be this part."""
    announced: bool = False
    """The road begins only at its own sign: an unknown type of road does not make it possible."""


class Limit(msgspec.Struct, frozen=True, kw_only=True, tag="limit", forbid_unknown_fields=True):
    """A maximum speed. A `cap` holds whatever a sign shows; without it a sign may put another limit in its place."""

    value: Speed
    unit: Unit
    cap: bool = False
    when: When = When()


class Advisory(msgspec.Struct, frozen=True, kw_only=True, tag="advisory", forbid_unknown_fields=True):
    """A recommended speed where no limit exists."""

    value: Speed
    unit: Unit
    when: When = When()


class Minimum(msgspec.Struct, frozen=True, kw_only=True, tag="minimum", forbid_unknown_fields=True):
    """A minimum speed."""

    value: Speed
    unit: Unit
    when: When = When()


class Prohibition(msgspec.Struct, frozen=True, kw_only=True, tag="prohibition", forbid_unknown_fields=True):
    """Something forbidden: `overtaking`, `entry`, `stopping`, `u_turn`, `lane`, ..."""

    what: str
    sign: str = ""
    when: When = When()


class Duty(msgspec.Struct, frozen=True, kw_only=True, tag="duty", forbid_unknown_fields=True):
    """Something the driver must or should do."""

    what: str
    action: LegalAction
    when: When = When()


class RightOfWay(msgspec.Struct, frozen=True, kw_only=True, tag="right_of_way", forbid_unknown_fields=True):
    """What a light, sign or unsigned junction (`light:red`, `sign:stop`, `unsigned`, `crossing`, ...) demands."""

    trigger: str
    action: LegalAction


class Condition(msgspec.Struct, frozen=True, kw_only=True, tag="condition", forbid_unknown_fields=True):
    """How signs are to be read: `posted_limit`, `plate:when_wet`, `zone`, `end`, `gantry`, `sign_over_default`, ..."""

    what: str


Effect = Limit | Advisory | Minimum | Prohibition | Duty | RightOfWay | Condition


class Source(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where a text stands: characters `start` to `end` of `document` (relative to the pack's folder)."""

    language: str
    document: str
    start: Offset
    end: Offset
    excerpt: str


class Provision(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `provisions.json`; the first source is the language the law is written in."""

    id: Name
    section: str
    kind: Kind
    sources: tuple[Source, ...]
    effects: tuple[Effect, ...]
    url: str = ""
    """Official address of the provision, where there is one."""
    replaces: tuple[Name, ...] = ()
    """Provisions of the pack that is extended, in whose place this one stands; inherited signs name this one then."""
    topics: Texts = {}
    """Words people use of the subject and the text does not; searched, never cited."""
    draft: bool = False
    """Copied or imported and not yet restated: no pack with a draft in it is loaded."""


class Plate(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a supplementary plate does to the sign above it."""

    type: Literal["wet", "hours", "vehicle", "ahead", "length", "end", "reason", "exempt"]
    classes: tuple[VehicleClass, ...] = ()
    electric_exempt: bool = False
    """The sign above does not bind an electric vehicle."""


class Sign(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `signs.json`: a sign, or a family of signs that differ by a number or a word."""

    code: Code
    national: str
    section: str
    provisions: tuple[str, ...]
    shape: str
    group: Literal["prohibition", "mandatory", "danger", "information", "variable", "plate"]
    action: LegalAction
    meaning: Texts
    sources: tuple[Source, ...]
    values: tuple[float, ...] = ()
    words: tuple[str, ...] = ()
    unit: Unit | None = None
    effect: Literal["limit", "zone", "end", "town", "road", "calm"] | None = None
    plate: Plate | None = None
    note: Texts = {}
    aliases: tuple[str, ...] = ()
    draft: bool = False
    """As of a provision."""


class Case(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `cases.json`: a question to a tool of the Rules service and what must hold of the answer."""

    name: str
    tool: Literal["applicable_limit", "interpret_sign", "right_of_way"]
    ask: dict[str, Any]
    expect: dict[str, Any]
    """Field names of the answer; `limit` as `[value, unit]` or null, `cites` as provision ids, `min_confidence`, `contains`."""
