"""The files of a rulepack as Structs: manifest, provisions with typed effects, sign table, test cases."""

from typing import Any, Literal

import msgspec

from proto.rules import LegalAction
from proto.scene import Unit

Kind = Literal["statute", "sign_table", "guidance"]
RoadType = Literal["urban", "rural", "motorway", "dual_carriageway", "living_street", "expressway"]
Texts = dict[str, str]
"""One text by language code."""


class Extends(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The pack this one adds to, and the oldest version it was written against."""

    id: str
    version: str


class Manifest(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`manifest.json`."""

    id: str
    title: str
    jurisdiction: str
    """ISO 3166 alpha-3."""
    version: str
    content_sha256: str
    effective_from: str
    effective_until: str | None
    units: Unit
    traffic_side: Literal["left", "right"]
    languages: tuple[str, ...]
    precedence: tuple[Kind, ...]
    plausible_limits: dict[RoadType, tuple[float, float]]
    """Per type of road the lowest and the highest limit, in `units`, that a doubtful reading may be believed to be."""
    extends: Extends | None = None
    disclaimer: str = ""


class When(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """On what an effect depends; an absent field is no condition."""

    road_types: tuple[RoadType, ...] = ()
    vehicle_classes: tuple[str, ...] = ()
    wet: bool | None = None
    snow: bool | None = None
    visibility_below_m: float | None = None
    hours: tuple[float, float] | None = None
    """Local time of day in hours, from and to; past midnight where the second is smaller."""
    subdivision: str | None = None
    """For example `GBR-WLS`; applies only where the jurisdiction is known to be this part."""
    announced: bool = False
    """The road begins only at its own sign: an unknown type of road does not make it possible."""


class Limit(msgspec.Struct, frozen=True, kw_only=True, tag="limit", forbid_unknown_fields=True):
    """A maximum speed. A `cap` holds whatever a sign shows; without it a sign may put another limit in its place."""

    value: float
    unit: Unit
    cap: bool = False
    when: When = When()


class Advisory(msgspec.Struct, frozen=True, kw_only=True, tag="advisory", forbid_unknown_fields=True):
    """A recommended speed where no limit exists."""

    value: float
    unit: Unit
    when: When = When()


class Minimum(msgspec.Struct, frozen=True, kw_only=True, tag="minimum", forbid_unknown_fields=True):
    """A minimum speed."""

    value: float
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
    start: int
    end: int
    excerpt: str


class Provision(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `provisions.json`; the first source is the language the law is written in."""

    id: str
    section: str
    kind: Kind
    sources: tuple[Source, ...]
    effects: tuple[Effect, ...]
    url: str = ""
    """Official address of the provision, where there is one."""
    topics: Texts = {}
    """Words people use of the subject and the text does not; searched, never cited."""


class Plate(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a supplementary plate does to the sign above it."""

    type: Literal["wet", "hours", "vehicle", "ahead", "length", "end", "reason", "exempt"]
    classes: tuple[str, ...] = ()


class Sign(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `signs.json`: a sign, or a family of signs that differ by a number or a word."""

    code: str
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


class Case(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `cases.json`: a question to a tool of the Rules service and what must hold of the answer."""

    name: str
    tool: Literal["applicable_limit", "interpret_sign", "right_of_way"]
    ask: dict[str, Any]
    expect: dict[str, Any]
    """Field names of the answer; `limit` as `[value, unit]` or null, `cites` as provision ids, `min_confidence`, `contains`."""
