"""What a message says, and the one memory of what was said; the arbiter keeps it and sends it with each decision."""

import msgspec

from proto.messages import Kind, Urgency


class News(msgspec.Struct, frozen=True, kw_only=True):
    """What a message says: equal news of one kind is no news."""

    what: str = ""
    """A name: of a stop, a fault, a country, a level, a sign; as the kind has it."""
    detail: str = ""
    value: float | None = None
    """Of a limit, in `unit`."""
    unit: str = ""
    advisory: bool = False
    """The limit is recommended."""
    grave: bool = False
    """Said firmly, or of an overspeed by more than a fifth."""
    track_id: int = 0

    def same_limit(self, other: "News") -> bool:
        """Whether both are about one limit."""
        return (self.value, self.unit) == (other.value, other.unit)


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """What is remembered of the fused advice once it is spoken."""

    kind: Kind
    """The kind that it replaces in memory."""
    news: News
    about: str = ""
    """Of kinds that several sources share: the tool, the rulepack."""
    tells: tuple[Kind, News] | None = None
    """Another message that is told with this one."""
    names: tuple[str, ...] = ()
    """Faults, each of which is owed a first notice of its own."""


class Spoken(msgspec.Struct, frozen=True, kw_only=True):
    """The last message of a kind."""

    kind: Kind
    about: str = ""
    news: News
    stamp_ns: int


class Warned(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """The last warning of a hazard."""

    hazard: str
    stamp_ns: int
    alarm: bool
    track_ids: tuple[int, ...] = ()
    """The road users in the path at that word."""
    stood_ns: int | None = None
    """Until when that hazard stood without a break."""


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """What the driver was told."""

    spoken: tuple[Spoken, ...] = ()
    """One for each kind, and what it is about."""
    hazards: tuple[Warned, ...] = ()
    """One for each hazard."""
    spoken_ns: int | None = None
    """When anything was said last."""
    urgency: Urgency = "info"
    """How grave that was."""
    noticed: tuple[str, ...] = ()
    """The faults of the car that were told in this drive."""

    def last(self, kind: Kind, about: str = "") -> Spoken | None:
        """The last message of a kind; None: no such message yet."""
        return next((each for each in self.spoken if (each.kind, each.about) == (kind, about)), None)
