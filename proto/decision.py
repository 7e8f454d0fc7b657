"""Events, fused advice, safety metrics, the decision, actuation and the trace of a tick."""

from typing import Annotated, Any, Literal

import msgspec

from proto.messages import Kind
from proto.messages import Urgency as Urgency
from proto.perception import Track
from proto.rules import Citation, LegalLimit, VehicleFacts
from proto.scene import Unit
from proto.speech import Memory, Message
from proto.speed_assistance import Picture
from proto.tools import Outcome

Language = Literal["en", "de", "fr", "nl", "pl", "it", "es"]
"""What advice is spoken in."""
DecisionKind = Literal["SILENT", "SPEAK", "ACT"]
Envelope = Literal["soft", "emergency"]
"""How hard and how long the car may be braked: bounded and short, or to standstill where nothing else avoids an impact."""


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """e_i: detector value g above threshold eta."""

    kind: str
    g: float
    eta: float
    detail: str = ""
    confidence: float = 1.0
    since_ns: int = 0


class Reason(msgspec.Struct, frozen=True, kw_only=True):
    """One reason behind a target, from one source."""

    source: str
    text: str
    confidence: float = 1.0
    citations: tuple[Citation, ...] = ()


class Fused(msgspec.Struct, frozen=True, kw_only=True):
    """What the experts' answers come to."""

    target_mps: float | None
    legal_limit: LegalLimit | None
    headway_factor: float
    directive: str
    justification: str
    confidence: float
    urgency: Urgency
    topic: str
    """What the message is about; deduplication and nag rate count by it."""
    hazard: str = ""
    reasons: tuple[Reason, ...] = ()
    citations: tuple[Citation, ...] = ()
    mu_low: float | None = None
    mu_high: float | None = None
    language: str = "en"
    unit: Unit = "km/h"
    degraded: tuple[str, ...] = ()
    new_information: bool = False
    first_notice: bool = False
    muted: bool = False
    ahead_mps: float | None = None
    """A lower limit that begins ahead, where it is what the message announces."""
    told_limit_mps: float | None = None
    """The legal limit in force, where the words tell it."""
    target_why: str = ""
    """What bounds the target most: `law`, `lead`, `person`, `red_light` ..."""
    asked_mps: float | None = None
    """The speed that the words ask for; None: they ask for none."""
    picture: Picture | None = None
    """The sign that is shown with the message."""


class SafetyMetrics(msgspec.Struct, frozen=True, kw_only=True):
    """The arbiter's numbers; an absent one is unknown."""

    ttc_s: float | None = None
    headway_s: float | None = None
    gap_m: float | None = None
    closing_mps: float | None = None
    d_min_low_mu_m: float | None = None
    d_min_high_mu_m: float | None = None
    rss_viol_low_mu: bool | None = None
    rss_viol_high_mu: bool | None = None
    lateral_viol: bool | None = None
    h: float | None = None
    r: float = 0.0
    u_act: float = 0.0
    u_speak: float = 0.0
    margin: float = 0.0
    delta: float = 0.0
    c_min: float = 0.0
    lead_track_id: int | None = None
    r_act: float = 0.0
    """r at the upper bound of friction and of an undoubted actor; the margin is computed from it."""


class ArbitrationRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What the orchestrator asks the arbiter."""

    tick: int
    stamp_ns: int
    fused: Fused
    ego_speed_mps: float | None
    ego_acceleration_mps2: float | None
    lead: Track | None
    pedestrian: Track | None = None
    others: tuple[Track, ...] = ()
    """The further road users in the ego's path: beside a doubted lead or person one of them may be the certain one."""
    h: float | None
    brake_envelope: float | None = None
    mu_low: float | None
    mu_high: float | None
    following_factor: float = 1.0
    tool_timed_out: bool = False
    degraded: tuple[str, ...] = ()
    seconds_since_spoken: float | None = None
    feedback: tuple["Feedback", ...] = ()
    """Labels given since the last tick; they move Delta and c_min within bounds."""
    message: Message | None = None
    """What is remembered of the fused advice if it is spoken; None without advice."""
    past: tuple[Kind, ...] = ()
    """Kinds whose last message announced what is over."""
    heard: Memory | None = None
    """What the driver was told, where the last decision was made without the arbiter: it replaces the arbiter's memory."""


class Decision(msgspec.Struct, frozen=True, kw_only=True):
    """SILENT, SPEAK or ACT, and why."""

    tick: int
    kind: DecisionKind
    reason: str
    metrics: SafetyMetrics
    act_withheld: str = ""
    """Why an ACT was not carried out: `no grant`, `driver overrides`, ... Empty: nothing was withheld."""
    brake_mps2: float = 0.0
    profile: str = ""
    profile_sha256: str = ""
    state_sha256: str = ""
    own: dict[str, Any] = {}
    """The arbiter's own reading, its state before, and its grant: with the request, enough to decide again."""
    hazard: str = ""
    """The hazard of the warning, seen by the orchestrator or by the arbiter; empty: the fused advice is spoken."""
    memory: Memory | None = None
    """What the driver was told, this decision's message included; None: the arbiter did not decide."""


class Advisory(msgspec.Struct, frozen=True, kw_only=True):
    """What the driver is told, or that there is nothing to tell. One a tick."""

    tick: int
    snapshot_stamp_ns: int
    kind: DecisionKind
    directive: str
    justification: str
    urgency: Urgency
    topic: str
    hazard: str
    target_mps: float | None
    legal_limit: LegalLimit | None
    unit: Unit
    language: str
    confidence: float
    citations: tuple[Citation, ...] = ()
    degraded: tuple[str, ...] = ()
    event_to_advice_ms: float | None = None
    snapshot_to_advice_ms: float | None = None
    act_withheld: str = ""
    late_tools: tuple[str, ...] = ()
    ahead_mps: float | None = None
    """A lower limit that begins ahead, where it is what the message announces: the speed to have come down to by then."""
    told_limit_mps: float | None = None
    """The legal limit in force, where the words tell it: all that a driver who hears them learns of it."""
    target_why: str = ""
    """What bounds the target most: `law`, `lead`, `person`, `red_light` ..."""
    asked_mps: float | None = None
    """The speed that the words ask for; None: they ask for none. A target that is shown alone asks for nothing."""
    picture: Picture | None = None
    """The sign that is shown with the message."""


class BrakeCommand(msgspec.Struct, frozen=True, kw_only=True):
    """A bounded longitudinal command; the receiver lets go on expiry and bounds it again."""

    deceleration_mps2: float
    jerk_mps3: float
    grant_id: str
    valid_for_ns: int = 200_000_000
    tick: int = 0
    envelope: Envelope = "soft"
    """Which of its bounds the receiver applies."""


class Grant(msgspec.Struct, frozen=True, kw_only=True):
    """Permission to actuate, made out of band and signed (Ed25519 over the canonical JSON without `signature`)."""

    grant_id: str
    vehicle: str
    capability: str
    max_deceleration_mps2: float
    max_duration_s: float
    expires_at: str
    issued_at: str
    key_id: str = ""
    signature: str = ""
    sequence: int = 0
    """Rises with each grant of a key: one that came before the newest that was seen, or before one that has ended, does not count."""
    envelope: Envelope = "soft"
    """`emergency` permits braking to standstill and holding there; a grant that names no envelope is `soft`."""


class Feedback(msgspec.Struct, frozen=True, kw_only=True):
    """A driver's or supervisor's label."""

    label: Literal["late_warning", "false_positive", "override", "helpful", "annoying"]
    tick: int = 0
    note: str = ""


Part = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^([A-Z]{3}-[A-Z0-9]{1,3})?$", description="a part of a country; empty: unknown", examples=["USA-TX"]
    ),
]


class Preferences(msgspec.Struct, frozen=True, kw_only=True):
    """How the driver wants to be spoken to."""

    language: Language = "en"
    """Language of what is said."""
    unit: Unit = "km/h"
    """Unit of speeds."""
    converts: bool = False
    """Limits are spoken in the driver's unit where the country's is another."""
    tolerance_low: float = 0.0
    """So much above a limit of up to 60 km/h no overspeed is sounded, in the driver's unit; at most 10."""
    tolerance_high: float = 0.0
    """The same above higher limits."""
    verbosity: Literal["short", "normal", "full"] = "normal"
    """How much of the reasons is told."""
    tone: Literal["neutral", "friendly"] = "neutral"
    """How it is worded."""
    muted: bool = False
    """Only hazards and first notices are spoken."""
    vehicle: VehicleFacts = VehicleFacts()
    """The facts of car, trailer and driver that limits depend on."""
    part: Part = ""
    """Where the drive is and the law of parts of a country differs. It counts while that country is believed."""


class TraceRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Everything one tick was decided from and came to: enough to decide it again."""

    tick: int
    stamp_ns: int
    cause: Literal["snapshot", "watchdog", "query"]
    inputs: dict[str, Any]
    """Per topic: sequence, stamp, and the message itself where it is small (as JSON data)."""
    events: tuple[Event, ...]
    calls: tuple[Outcome, ...]
    fused: Fused
    request: ArbitrationRequest | None
    decision: Decision
    advisory: Advisory
    state_sha256: str = ""
    """SHA-256 of the orchestrator's state after the tick, as canonical JSON."""
    state: dict[str, Any] | None = None
    """The whole state, at the first tick and every hundred."""
    versions: dict[str, str] = {}
    """Rulepacks, profile, prompts, models, code."""
    world: dict[str, Any] = {}
