"""A candidate: one message that could be spoken, and the functions that find candidates."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from proto.decision import Event, Urgency
from proto.messages import ROWS, Kind, KindRow
from proto.rules import SignMeaning
from proto.scene import Unit
from proto.speech import Message, News
from services.orchestrator.state import State
from services.orchestrator.target.target import Target


class Candidate(NamedTuple):
    """One thing that could be said; how its kind behaves stands in `proto.messages.KINDS`."""

    kind: Kind
    news: News
    phrase: str
    urgency: Urgency
    values: dict[str, Any]
    why: tuple[str, ...] = ()
    """Phrases of its justification."""
    about: str = ""
    """Of kinds that are remembered for each: the tool, the rulepack, the sign."""
    hazard: str = ""
    first_since_ns: int | None = None
    """Where the first notice of an episode is owed: when the episode began."""
    confidence: float = 1.0
    again_s: float | None = None
    """Said again after this time, where it is another than its kind's."""
    tells: tuple[Kind, News] | None = None
    """Another message that is told with this one: it is no news any more."""
    ahead_mps: float | None = None
    """The limit that it announces."""
    asked_mps: float | None = None
    """The speed that its words ask for."""
    number: tuple[float, Unit] | None = None
    """The number on the sign beside it."""
    plate: str = ""
    """The words below that sign."""
    limit_mps: float | None = None
    """The legal limit in force, where its words tell it."""
    names: tuple[str, ...] = ()
    """What it is about, where each is owed a first notice of its own."""
    law: SignMeaning | None = None
    """What the Rules say of the sign behind which that limit is the law's own."""

    @property
    def row(self) -> KindRow:
        """How its kind behaves."""
        return ROWS[self.kind]

    @property
    def topic(self) -> str:
        """The advisory's topic."""
        return f"{self.row.sent_as}:{self.about}" if self.row.by_source else self.row.sent_as

    @property
    def remembered_as(self) -> Kind:
        """The kind that it replaces in memory."""
        return self.row.remembered_as or self.kind

    @property
    def message(self) -> Message:
        """What is remembered of it once it is spoken."""
        return Message(kind=self.remembered_as, news=self.news, about=self.about, tells=self.tells, names=self.names)

    @property
    def repeat_s(self) -> float:
        """The same news is said again after this time."""
        return self.row.repeat_s if self.again_s is None else self.again_s


SPOKEN_S = 2.0
"""A message is heard for so long (the arbiter's `speech_gap_s`)."""


def told_within(state: State, kind: Kind, seconds: float) -> bool:
    """Whether a kind of message, whatever about, was spoken so lately; or the arbiter by itself warned of a hazard of that kind."""
    spoken = (each.stamp_ns for each in state.memory.spoken if each.kind == kind)
    warned = (each.stamp_ns for each in state.memory.hazards if each.hazard in ROWS[kind].hazards)
    return any(state.now_ns - stamp_ns < seconds * 1e9 for stamp_ns in (*spoken, *warned))


Maker = Callable[[State, Target, dict[str, Event]], Iterator[Candidate]]
