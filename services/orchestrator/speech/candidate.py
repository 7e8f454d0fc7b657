"""One thing that could be said, and who finds such things."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from proto.decision import Event, Urgency
from proto.rules import SignMeaning
from services.orchestrator.state import State
from services.orchestrator.target.target import Target

OVERSPEED_TOLD_S = 60.0
"""Who drives too fast once more within this time has been told; by more than a fifth he is told at once."""


class Matter(NamedTuple):
    """One thing to say."""

    topic: str
    """Messages on one topic replace each other."""
    key: str
    """The same key on the same topic is the same news."""
    phrase: str
    urgency: Urgency
    values: dict[str, Any]
    why: tuple[str, ...] = ()
    """Phrases of its justification."""
    hazard: str = ""
    first_since_ns: int | None = None
    """Set where the first notice of an episode is owed: when the episode began."""
    repeat_s: float = 60.0
    confidence: float = 1.0
    kind: str = ""
    tells: tuple[str, str] | None = None
    """Slot and key of another matter that is told with this one: it is no news any more."""
    ahead_mps: float | None = None
    """The limit that it announces."""
    limit_mps: float | None = None
    """The legal limit in force, where its words tell it."""
    names: tuple[str, ...] = ()
    """What it is about, where each is owed a first notice of its own."""
    law: SignMeaning | None = None
    """What the Rules say of the sign behind which that limit is the law's own."""

    @property
    def slot(self) -> str:
        """Under which it is remembered: its kind where several kinds share a topic."""
        return self.kind or self.topic


def told_within(state: State, slot: str, seconds: float) -> bool:
    """Whether what is remembered under a slot was spoken of so lately."""
    told = state.memory.last(slot)
    return told is not None and state.now_ns - told.stamp_ns < seconds * 1e9


def limit_key(value: float, unit: str) -> str:
    """By which a limit is remembered."""
    return f"{value:g} {unit}"


def over_key(limit: str, *, far: bool) -> str:
    """By which an overspeed is remembered, from its limit's key."""
    return f"over {limit} far" if far else f"over {limit}"


def over_lower(key: str, told: str) -> bool:
    """Whether an overspeed is of a lower limit than the one told, or of one in other units: a border lies between them."""
    value, unit = key.split()[1:3]
    told_value, told_unit = told.split()[1:3]
    return unit != told_unit or float(value) < float(told_value)


Maker = Callable[[State, Target, dict[str, Event], tuple[str, ...]], Iterator[Matter]]
