"""What the orchestrator remembers between two ticks. Frozen, and the same bytes for the same drive."""

import hashlib
import math
from typing import Any

import msgspec

from domain import ego_speed
from domain.units import KM_PER_MILE
from proto.decision import Preferences
from proto.observed import value_of
from proto.rules import PlaceName, PostedLimit, RulesAnswer, SignMeaning
from proto.scene import Candidate, Unit
from proto.speech import Memory, News
from proto.tools import Effect
from proto.vehicle import Degradation, VehicleHealth
from proto.weather import Conditions
from proto.world import WorldState

PERMISSION = ("green", "off")
"""States of a light that do not ask to stop."""


def value_kmh(value: float, unit: Unit | None) -> float:
    """A posted number in km/h; without a unit it counts as km/h, the lower reading."""
    return value * KM_PER_MILE if unit == "mph" else value


class Believed(msgspec.Struct, frozen=True, kw_only=True):
    """A fact that holds until another ends it."""

    value: str
    confidence: float
    since_ns: int
    assumed: bool = False
    """By a setting; no picture has shown it yet."""
    evidence: str = ""
    """Codes of signs and their weights (`border_evidence.py`); empty: not stated."""


class InForce(msgspec.Struct, frozen=True, kw_only=True):
    """A limit whose sign the ego has passed."""

    posted: PostedLimit
    since_ns: int
    track_id: int = 0

    @property
    def kmh(self) -> float:
        """The limit in km/h."""
        return value_kmh(self.posted.value, self.posted.unit)


class SignAhead(msgspec.Struct, frozen=True, kw_only=True):
    """A sign not yet passed, moved along by the ego's own speed."""

    track_id: int
    kind: str
    reading: str
    scope: str
    value: float | None
    unit: Unit | None
    confidence: float
    believed: bool
    distance_m: float | None
    seen_ns: int
    first_ns: int
    seen_m: float | None = None
    """Its distance when it was last seen."""
    candidates: tuple[Candidate, ...] = ()
    plates: tuple[str, ...] = ()
    missed_ns: int = 0
    """For how long pictures of the road were read without it since."""
    shared: bool = False
    """Its plates and its scope are those of another track of the same sign."""
    text: str = ""
    own_lane: bool = True

    @property
    def at_m(self) -> float:
        """Its distance; infinite where that is unknown."""
        return math.inf if self.distance_m is None else self.distance_m

    @property
    def kmh(self) -> float:
        """The number it shows in km/h; 0 without one."""
        return value_kmh(self.value or 0.0, self.unit)

    @property
    def head(self) -> str:
        """Its code without what follows the colon."""
        return self.reading.partition(":")[0]

    @property
    def ours(self) -> bool:
        """Whether it is believed and stands over the ego's lane."""
        return self.believed and self.own_lane

    @property
    def doubted_limit(self) -> bool:
        """Whether it may show a limit and is not believed."""
        return self.kind == "limit" and not self.believed


class Signs(msgspec.Struct, frozen=True, kw_only=True):
    """Limits in force, signs ahead, and the evidence that ended earlier limits."""

    permanent: InForce | None = None
    gantry: InForce | None = None
    zone: InForce | None = None
    conditional: tuple[InForce, ...] = ()
    ahead: tuple[SignAhead, ...] = ()
    ended: tuple[str, ...] = ()
    """End signs passed since the last sign that set a limit."""
    changed_ns: int | None = None
    """When the limits in force last changed."""
    gantry_changed_ns: int | None = None
    jurisdiction: Believed | None = None
    former_jurisdiction: str = ""
    """The country before the border crossed last; empty: unknown, or no border was crossed."""
    crossed: bool = False
    """Whether a border was crossed on this drive."""
    unknown_ns: int | None = None
    """When the country became one whose signs are unknown here."""
    units: Believed | None = None
    traffic_side: Believed | None = None
    road_type: Believed | None = None
    recent: tuple[SignAhead, ...] = ()
    """The last signs passed, for questions about them."""
    turned_rad: float = 0.0
    """The ego's turn since it came near the junction."""
    near_junction: bool = False
    junction_m: float = 0.0
    """Distance to that junction, negative behind it."""

    @property
    def country(self) -> str | None:
        """The code of the country; None: unknown."""
        return self.jurisdiction.value if self.jurisdiction is not None else None

    @property
    def road(self) -> str:
        """The type of road by signs; empty: unknown."""
        return self.road_type.value if self.road_type is not None else ""


class Light(msgspec.Struct, frozen=True, kw_only=True):
    """The traffic light ahead as last read."""

    state: str
    confidence: float
    seen_ns: int
    distance_m: float | None
    track_id: int
    arrow: str = ""
    """Where the lamp's arrow points (`left`, `straight`, `right`); empty: a round lamp, for every way."""
    missed_ns: int = 0
    """For how long pictures of the road were read without it since."""
    lined: bool = False
    """A map told its own line, which may be passed by now."""
    lost_at_line: bool = False
    """The ego stood at the line with the lamp above the cameras' view: its state is unknown."""
    seen_twice: bool = False
    """The front end believes it, or a second picture shows a lamp there that does not permit to go, too."""

    @property
    def permits(self) -> bool:
        """Whether it does not ask to stop."""
        return self.state in PERMISSION


class GiveWay(msgspec.Struct, frozen=True, kw_only=True):
    """What a map knows of giving way ahead, moved along when it is silent."""

    line_m: float | None = None
    """The nearest yield line."""
    junction_m: float | None = None
    """The middle of the next junction."""
    ruled: bool = False
    """A line before that junction settles the right of way."""


class Limiter(msgspec.Struct, frozen=True, kw_only=True):
    """A restriction that a third-party expert asks for."""

    tool: str
    until_ns: int
    confidence: float
    target_mps: float | None = None
    speed_factor: float = 1.0
    headway_factor: float = 1.0
    text: str = ""


class Lost(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """An actor's bound on the target: as it is while the actor is in the way, else as when it was last seen there."""

    track_id: int
    why: str
    mps: float
    stamp_ns: int
    """When the actor bounded the target last."""
    known: bool = True
    """The actor was seen well, for long enough, at least once; any other is missed for a shorter time."""
    higher_ns: int | None = None
    """Since when the actor is seen without a break to ask for less than this; None: it does not."""
    higher_mps: float | None = None
    """The least that it asked for in that time; None: nothing."""


class ToldPlace(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """What the Rules call a country in one language."""

    code: str
    language: str
    name: PlaceName


class Held(msgspec.Struct, frozen=True, kw_only=True):
    """The last word of each expert; it bounds the target until a better one replaces it."""

    legal: RulesAnswer | None = None
    legal_key: str = ""
    """The question that it answered."""
    legal_h: float | None = None
    """The time of day with which that was asked; None: none."""
    places: tuple[ToldPlace, ...] = ()
    """The countries of the last answers by name, the newest last."""
    legal_ns: int = 0
    """When it was answered."""
    conditions: Conditions | None = None
    conditions_ns: int | None = None
    degradation: Degradation | None = None
    degradation_ns: int | None = None
    health: VehicleHealth | None = None
    meaning: SignMeaning | None = None
    place: SignMeaning | None = None
    """Of a sign ahead without a number behind which the law sets a limit."""
    place_key: str = ""
    """The question that it answered."""
    right_of_way: RulesAnswer | None = None
    right_of_way_key: str = ""
    """The question that it answered."""
    limiters: tuple[Limiter, ...] = ()
    lead_mps: float | None = None
    person_mps: float | None = None
    """Their bounds on the target when they were last seen."""
    lost: tuple[Lost, ...] = ()
    """The same of each actor of the last moments; an actor that vanished, faded or leapt still counts."""
    doubted_mps: float | None = None
    """The lowest limit that a sign in doubt may show, by the Rules."""
    doubted_for_ns: int = 0
    """How long pictures of the road have to be read until that doubt ends."""
    road: str = ""
    """The type of road as it was last known."""
    speed: ego_speed.Believed | None = None
    """The ego's speed as it was last believed, and how far its accelerations are borne out."""
    place_m: float | None = None
    """The room to the place to give way at that bounded the target last; None: none did."""
    target_mps: float | None = None
    target_ns: int | None = None


class Cached(msgspec.Struct, frozen=True, kw_only=True):
    """When a question was answered, or failed; results stand in `Held`."""

    tool: str
    arguments_sha256: str
    stamp_ns: int
    ok: bool


class Onset(msgspec.Struct, frozen=True, kw_only=True):
    """Since when an event holds."""

    kind: str
    since_ns: int
    last_ns: int
    detail: str = ""


class GapSeen(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """Where an actor ahead was seen."""

    track_id: int
    x_m: float
    stamp_ns: int
    well: bool = False
    """Seen well enough to be spoken of (`actors.well_seen`)."""


class Overspeed(msgspec.Struct, frozen=True, kw_only=True):
    """What the speed assistance remembers of an overspeed (`speed_assistance.py`)."""

    limit_mps: float | None = None
    """The limit as it was last known."""
    since_ns: int | None = None
    """Since when the ego is faster; None: it is not, or that is unknown."""
    above_ns: tuple[int | None, ...] = ()
    """Since when it is above each row of the table."""
    sounded_ns: int | None = None
    """When it was sounded; None: it was not yet."""
    ended: bool = False
    """The sound is over: by its time, or since the driver answered it."""


class Utc(msgspec.Struct, frozen=True, kw_only=True):
    """UTC in s since 1970 as satellites told it last and first, each with the time of our clock, while the two went on together."""

    utc_s: float
    at_ns: int
    first_s: float
    since_ns: int
    doubted_to_ns: int = 0
    """Until then it is not believed: satellites contradicted what was believed."""


class State(msgspec.Struct, frozen=True, kw_only=True):
    """All that is remembered."""

    tick: int = 0
    now_ns: int = 0
    looked_ns: int = 0
    """How much of the time since the last tick pictures tell of (`validity.looked_ns`)."""
    looked_to_ns: int = 0
    """The stamp of the newest picture that was looked at: an older one that comes behind it begins no look again."""
    world: WorldState = WorldState(stamp_ns=0, tick=0)
    signs: Signs = Signs()
    light: Light | None = None
    stop_m: float | None = None
    """Distance to the stop line of the map, moved along when that is silent."""
    stop_kind: str = ""
    give_way: GiveWay = GiveWay()
    halted_ns: int | None = None
    """When the ego last stood at the line of the stop sign ahead."""
    line_halted_ns: int | None = None
    """When it last stood at the stop line of the map."""
    held: Held = Held()
    asked: tuple[Cached, ...] = ()
    memory: Memory = Memory()
    """What the driver was told: the arbiter's memory, or what was said without it (`unheard`)."""
    unheard: bool = False
    """The last decision was made without the arbiter, which has to hear what was said."""
    onsets: tuple[Onset, ...] = ()
    gaps: tuple[GapSeen, ...] = ()
    """Sightings of actors ahead in the last moments; their stated speed is an estimate."""
    fast_since_ns: int | None = None
    """Since when the ego and all vehicles that go its way are fast (`road_kind.fast_since`)."""
    missing: tuple[Onset, ...] = ()
    """Topics and services that are missing."""
    overspeed: Overspeed = Overspeed()
    limit_mps: float | None = None
    """The limit in force as it was last known well enough to be spoken."""
    former_mps: float | None = None
    """The one before it."""
    limit_ns: int | None = None
    """Since when the limit is `limit_mps`."""
    announced: News | None = None
    """The limit that was announced last, until another one is told."""
    utc: Utc | None = None
    preferences: Preferences = Preferences()
    effects: tuple[tuple[str, Effect], ...] = ()
    advisor: dict[str, Any] = {}
    """What an advisor beside the tools remembers, as JSON data."""

    @property
    def speed_mps(self) -> float | None:
        """The ego's speed; None: unknown."""
        return value_of(self.world.ego.speed_mps)

    @property
    def road(self) -> str:
        """The type of road by signs or map; empty: unknown."""
        return value_of(self.world.environment.road_type) or ""

    @property
    def place(self) -> str | None:
        """Whose law is asked for: the country's, or that of the part of it that the driver has named; None: unknown."""
        country, part = self.signs.country, self.preferences.part
        return part if country is not None and part.startswith(f"{country}-") else country


def digest(state: State) -> str:
    """SHA-256 of the state as canonical JSON."""
    return hashlib.sha256(msgspec.json.encode(state, order="deterministic")).hexdigest()
