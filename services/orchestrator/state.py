"""What the orchestrator remembers between two ticks. Frozen, and the same bytes for the same drive."""

import hashlib
from typing import Any

import msgspec

from proto.decision import Preferences
from proto.rules import PostedLimit, RulesAnswer, SignMeaning
from proto.scene import Candidate, Unit
from proto.speech import Memory
from proto.tools import Effect
from proto.vehicle import Degradation, VehicleHealth
from proto.weather import Conditions
from proto.world import WorldState


class Believed(msgspec.Struct, frozen=True, kw_only=True):
    """A fact that holds until another one ends it."""

    value: str
    confidence: float
    since_ns: int
    assumed: bool = False
    """By a setting; no picture has shown it yet."""
    evidence: str = ""
    """On what it is believed, where that is told: codes of signs and their weights (`evidence.py`)."""


class InForce(msgspec.Struct, frozen=True, kw_only=True):
    """A limit whose sign the ego has passed."""

    posted: PostedLimit
    since_ns: int
    track_id: int = 0


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
    """How far away it was when it was last seen."""
    candidates: tuple[Candidate, ...] = ()
    plates: tuple[str, ...] = ()
    shared: bool = False
    """Its plates, and its scope, are those that another track shows of the same sign."""
    text: str = ""
    own_lane: bool = True


class Signs(msgspec.Struct, frozen=True, kw_only=True):
    """Limits in force, signs ahead, and the evidence that ended earlier limits."""

    permanent: InForce | None = None
    gantry: InForce | None = None
    zone: InForce | None = None
    conditional: tuple[InForce, ...] = ()
    ahead: tuple[SignAhead, ...] = ()
    ended: tuple[str, ...] = ()
    """Readings of the end signs passed since the last sign that set a limit."""
    changed_ns: int | None = None
    """When the limits in force last changed."""
    gantry_changed_ns: int | None = None
    jurisdiction: Believed | None = None
    former_jurisdiction: str = ""
    """The country before the border crossed last; empty: none was, or that one was not known."""
    crossed: bool = False
    """Whether a border was crossed on this drive."""
    unknown_ns: int | None = None
    """When the country became unknown: a border, or a statement, of one whose signs nobody knows here."""
    units: Believed | None = None
    traffic_side: Believed | None = None
    road_type: Believed | None = None
    recent: tuple[SignAhead, ...] = ()
    """The last signs passed, for questions about them."""
    turned_rad: float = 0.0
    """How far the ego has turned since it came near the junction."""
    near_junction: bool = False
    junction_m: float = 0.0
    """Distance to the junction that came near, negative behind it."""


class Light(msgspec.Struct, frozen=True, kw_only=True):
    """The traffic light ahead as last read."""

    state: str
    confidence: float
    seen_ns: int
    distance_m: float | None
    track_id: int
    arrow: str = ""
    """Where the lamp's arrow points (`left`, `straight`, `right`); empty: a round lamp, which is for every way."""
    lost_at_line: bool = False
    """The ego stood right before it while no camera had seen it for a while: it may have changed, and nobody knows."""


class GiveWay(msgspec.Struct, frozen=True, kw_only=True):
    """What a map knows of where one may have to give way, moved along when it is silent (`giving_way.py`)."""

    line_m: float | None = None
    """The nearest line at which one gives way."""
    junction_m: float | None = None
    """The middle of the next junction."""
    ruled: bool = False
    """A line before that junction says who goes first."""


class Limiter(msgspec.Struct, frozen=True, kw_only=True):
    """What a third-party expert asks for, and until when."""

    tool: str
    until_ns: int
    confidence: float
    target_mps: float | None = None
    speed_factor: float = 1.0
    headway_factor: float = 1.0
    text: str = ""


class Lost(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """How an actor bounded the target when it was last seen."""

    track_id: int
    why: str
    mps: float
    stamp_ns: int


class Held(msgspec.Struct, frozen=True, kw_only=True):
    """The last word of each expert: it bounds the target until a better one replaces it."""

    legal: RulesAnswer | None = None
    legal_key: str = ""
    """The question that it answered."""
    legal_ns: int = 0
    """When it was answered."""
    conditions: Conditions | None = None
    conditions_ns: int | None = None
    degradation: Degradation | None = None
    degradation_ns: int | None = None
    health: VehicleHealth | None = None
    meaning: SignMeaning | None = None
    place: SignMeaning | None = None
    """Of a sign ahead behind which the law sets a limit of its own: of a town, a calm street."""
    place_key: str = ""
    """The question that it answered."""
    right_of_way: RulesAnswer | None = None
    right_of_way_key: str = ""
    """The question that it answered."""
    limiters: tuple[Limiter, ...] = ()
    lead_mps: float | None = None
    person_mps: float | None = None
    """How the lead and a person bounded the target when they were last seen."""
    lost: tuple[Lost, ...] = ()
    """The same of each actor of the last moments; it counts for those who vanished."""
    doubted_mps: float | None = None
    doubted_until_ns: int = 0
    target_mps: float | None = None
    target_ns: int | None = None


class Cached(msgspec.Struct, frozen=True, kw_only=True):
    """That a question was answered, or failed, and when; results themselves stand in `Held`."""

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


class State(msgspec.Struct, frozen=True, kw_only=True):
    """All of it."""

    tick: int = 0
    now_ns: int = 0
    world: WorldState = WorldState(stamp_ns=0, tick=0)
    signs: Signs = Signs()
    light: Light | None = None
    stop_m: float | None = None
    """Distance to the stop line, moved along when the map is silent."""
    stop_kind: str = ""
    give_way: GiveWay = GiveWay()
    halted_ns: int | None = None
    """When the ego last stood at the line of the stop sign ahead."""
    line_halted_ns: int | None = None
    """The same of the stop line that a map knows."""
    held: Held = Held()
    asked: tuple[Cached, ...] = ()
    memory: Memory = Memory()
    """What the driver was told: the arbiter's memory, or what was said without it (`unheard`)."""
    unheard: bool = False
    """The last decision was made without the arbiter, which has to hear what was said."""
    onsets: tuple[Onset, ...] = ()
    gaps: tuple[GapSeen, ...] = ()
    """Where actors ahead were in the last moments: whether they come nearer can be seen, their speed is an estimate."""
    missing: tuple[Onset, ...] = ()
    """Since when topics and services are missing."""
    preferences: Preferences = Preferences()
    effects: tuple[tuple[str, Effect], ...] = ()
    advisor: dict[str, Any] = {}
    """What an advisor beside the tools remembers, as JSON data."""


def digest(state: State) -> str:
    """SHA-256 of the state as canonical JSON."""
    return hashlib.sha256(msgspec.json.encode(state, order="deterministic")).hexdigest()
