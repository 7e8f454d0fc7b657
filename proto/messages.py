"""The kinds of message that a driver may hear: one table, read by candidates, arbiter, metrics and documentation."""

import math
from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Literal, NamedTuple

Urgency = Literal["info", "advice", "warning", "alarm"]


class Kind(StrEnum):
    """What a message is about."""

    PERSON = "person"
    LEAD = "lead"
    STOP = "stop"
    GIVE_WAY = "give_way"
    VEHICLE = "vehicle"
    OVERSPEED = "overspeed"
    BORDER = "border"
    LIMIT = "limit"
    GO = "go"
    DOUBT = "doubt"
    FRICTION = "friction"
    FOREIGN = "foreign"
    APPROACH = "approach"
    AHEAD = "ahead"
    EXPERT = "expert"
    DEGRADED = "degraded"
    OLD_RULES = "rules"
    SLOW = "slow"
    CAUTION = "caution"


class KindRow(NamedTuple):
    """How a kind of message behaves."""

    kind: Kind
    says: str
    """What it is, for people."""
    repeat_s: float = 60.0
    """The same news is said again after this time; inf: once in a drive."""
    repeats: str = ""
    """When it is said again, where something else than a time decides."""
    first_notice: bool = False
    """The first notice of an episode is owed: neither mute nor budget holds it back."""
    presses: bool = False
    """Of no use later, so that it waits for no budget."""
    hazards: tuple[str, ...] = ()
    """The hazards that it may warn of."""
    explained_by: Literal["", "meaning", "place", "right_of_way"] = ""
    """Which answer of the Rules is told beside it."""
    topic: str = ""
    """Under which name it goes out, where several kinds replace each other; empty: its own."""
    by_source: bool = False
    """Several sources share it: each has a topic of its own."""
    remembered_as: Kind | None = None
    """The kind that it replaces in memory, where it is another."""

    @property
    def sent_as(self) -> str:
        """The advisory's topic."""
        return self.topic or self.kind.value


KINDS: tuple[KindRow, ...] = (
    KindRow(Kind.PERSON, "a person in or near the way", 4.0, presses=True, hazards=("pedestrian",), explained_by="right_of_way"),
    KindRow(Kind.LEAD, "a vehicle that is met soon", 4.0, hazards=("closing_lead", "slow_traffic")),
    KindRow(
        Kind.STOP, "a red light, a stop sign, a stop line", 20.0, presses=True,
        hazards=("red_light", "stop_sign"), explained_by="right_of_way",
    ),
    KindRow(Kind.GIVE_WAY, "a place to give way", 10.0, presses=True),
    KindRow(Kind.VEHICLE, "a fault of the car", 300.0, first_notice=True, hazards=("vehicle_fault",)),
    KindRow(
        Kind.OVERSPEED, "the ego is faster than the limit", math.inf, "once the limit was kept, or fell",
        first_notice=True, topic="limit", explained_by="place",
    ),
    KindRow(Kind.BORDER, "another country begins", 600.0, explained_by="place"),
    KindRow(Kind.LIMIT, "the limit in force", 3600.0, explained_by="place"),
    KindRow(Kind.GO, "the light is green", presses=True, topic="stop", remembered_as=Kind.STOP, explained_by="right_of_way"),
    KindRow(Kind.DOUBT, "a sign that cannot be read for sure", explained_by="meaning"),
    KindRow(Kind.FRICTION, "the road is slippery", 600.0),
    KindRow(Kind.FOREIGN, "a sign with a plate in another language", 120.0, explained_by="meaning"),
    KindRow(Kind.APPROACH, "a lower limit ahead that is not kept without slowing down now", presses=True, topic="ahead"),
    KindRow(Kind.AHEAD, "a lower limit ahead", presses=True),
    KindRow(Kind.EXPERT, "what a third-party tool asks for", by_source=True),
    KindRow(Kind.DEGRADED, "a service or a topic is missing", 120.0, first_notice=True),
    KindRow(Kind.OLD_RULES, "a rulepack is outdated, or not in force", math.inf, first_notice=True, by_source=True),
    KindRow(Kind.SLOW, "a bare word to slow down, of a baseline"),
    KindRow(Kind.CAUTION, "a hazard that the arbiter alone sees"),
)  # fmt: skip
"""In order of weight: of several candidates that are equally due the first is said."""
ROWS: Mapping[Kind, KindRow] = MappingProxyType({row.kind: row for row in KINDS})
WEIGHT: Mapping[Kind, int] = MappingProxyType({row.kind: at for at, row in enumerate(KINDS)})
"""Place in the table: the lower, the weightier."""
PRESSING = frozenset(row.sent_as for row in KINDS if row.presses)
"""Topics whose advice is useless later."""

WORD_COUNTS_NS = 10_000_000_000
"""For so long a warning counts as heard; what was said longer ago belongs to another moment."""
GRAVER: Mapping[str, tuple[str, ...]] = MappingProxyType({"slow_traffic": ("closing_lead",)})
"""Hazard -> graver hazards of the same road user: a driver who was told to brake for a vehicle knows that it is slow."""


def covers(told: str, hazard: str) -> bool:
    """Whether a warning of one hazard is a warning of another."""
    return told == hazard or told in GRAVER.get(hazard, ())
