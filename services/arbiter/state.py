"""What the arbiter remembers between two decisions; small, frozen, hashed into every decision."""

import hashlib

import msgspec

from proto.speech import Memory
from services.arbiter.assessment.reading import Pedals
from services.arbiter.profiles.profile import Profile


class Adapted(msgspec.Struct, frozen=True, kw_only=True):
    """What feedback has moved."""

    delta: float
    c_min: float
    updated_ns: int | None = None


class Attention(msgspec.Struct, frozen=True, kw_only=True):
    """How much the driver may still be told."""

    messages: float
    refilled_ns: int | None = None


class Braked(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """A span in which the car was braked while it moved."""

    from_ns: int
    until_ns: int


class Owed(msgspec.Struct, frozen=True, kw_only=True):
    """What a restarted arbiter has to know of the braking before: seconds that count against the budget, and whether it rests."""

    braked_s: float = 0.0
    rests: bool = False


class Intervention(msgspec.Struct, frozen=True, kw_only=True):
    """An intervention under way (`since_ns`), or the rest after one (`rest_until_ns`). Times are of the running clock."""

    since_ns: int | None = None
    last_ns: int | None = None
    brake_mps2: float = 0.0
    pedals: Pedals = Pedals()
    rest_until_ns: int | None = None
    holds: bool = False
    """Whether it has brought the car to standstill and holds it there."""
    braked: tuple[Braked, ...] = ()
    """What counts against the budget, oldest first."""
    track_id: int | None = None
    """The track of the road user that the car is braked for, as sighted last."""
    sighted_ns: int = 0
    """When that road user was last sighted without doubt."""
    stood_m: float | None = None
    """The gap to it by that sighting and the way driven since, where it stands; None: it moves."""
    through_ns: int | None = None
    """When it has left the way at its speed then, where it drives across."""


class Sighting(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """Where the arbiter itself saw an actor in the path, or a person that comes to it."""

    track_id: int
    gap_m: float
    stamp_ns: int


class ArbiterState(msgspec.Struct, frozen=True, kw_only=True):
    """All of it."""

    adapted: Adapted
    attention: Attention
    memory: Memory = Memory()
    intervention: Intervention = Intervention()
    sightings: tuple[Sighting, ...] = ()
    run_ns: int = 0
    """The running clock (`braking/budget.py`)."""
    seen_ns: int | None = None
    """The wall clock at the last decision."""
    warned_ns: int | None = None
    """Since when on the running clock the driver has been warned of a road user."""


def fresh(profile: Profile) -> ArbiterState:
    """The state of a drive's first tick."""
    return ArbiterState(
        adapted=Adapted(delta=profile.delta, c_min=profile.c_min),
        attention=Attention(messages=profile.budget_messages),
    )


def digest(state: ArbiterState) -> str:
    """SHA-256 of the state as canonical JSON."""
    return hashlib.sha256(msgspec.json.encode(state, order="deterministic")).hexdigest()
