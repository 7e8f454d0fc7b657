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


class Intervention(msgspec.Struct, frozen=True, kw_only=True):
    """An intervention under way (`since_ns`), or the rest after one (`rest_until_ns`)."""

    since_ns: int | None = None
    last_ns: int | None = None
    brake_mps2: float = 0.0
    pedals: Pedals = Pedals()
    rest_until_ns: int | None = None


class Sighting(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """Where the arbiter itself saw an actor in the path."""

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


def fresh(profile: Profile) -> ArbiterState:
    """The state of a drive's first tick."""
    return ArbiterState(
        adapted=Adapted(delta=profile.delta, c_min=profile.c_min),
        attention=Attention(messages=profile.budget_messages),
    )


def digest(state: ArbiterState) -> str:
    """SHA-256 of the state as canonical JSON."""
    return hashlib.sha256(msgspec.json.encode(state, order="deterministic")).hexdigest()
