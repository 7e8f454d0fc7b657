"""A limit read wrongly: another number that signs of the country show, or the same number in the other unit."""

from typing import NamedTuple

import msgspec

from evaluation.corruption.chance import chance, ranked
from evaluation.corruption.spec import CorruptionSpec
from proto.scene import Candidate, Fact, Unit
from services.drivelm.vocabulary.classes import SENTENCES
from services.drivelm.vocabulary.jurisdictions import allowed_limits, unit_of

LEAST = 20
"""Lower numbers are on the lists, and hardly on roads."""
_OTHER: dict[Unit, Unit] = {"km/h": "mph", "mph": "km/h"}


class Encounter(NamedTuple):
    """One physical sign on its way past: its key, the numbers that it shows, and the country that it stands in."""

    key: str
    values: frozenset[float] = frozenset()
    country: str | None = None


def readable(fact: Fact) -> bool:
    """Whether a fact shows a limit in numbers."""
    return fact.kind == "limit" and fact.value is not None and fact.scope != "end"


def misread(spec: CorruptionSpec, fact: Fact, encounter: Encounter) -> Fact:
    """The fact as it is misread during this encounter; belief, confidence and place stay as they were."""
    if chance(spec.seed, "misread_unit", encounter.key) < spec.misread_unit:
        return msgspec.structs.replace(fact, unit=_OTHER[fact.unit or unit_of(encounter.country) or "km/h"])
    head, _, before = fact.reading.partition(":")
    reading = f"{head}:{_number(spec, fact, encounter)}"
    return msgspec.structs.replace(
        fact,
        reading=reading,
        value=float(reading.partition(":")[2]),
        candidates=tuple(_renamed(each, f"{head}:{before}", reading) for each in fact.candidates),
        sentence=SENTENCES.get(reading, ""),
    )


def _number(spec: CorruptionSpec, fact: Fact, encounter: Encounter) -> int:
    """The same along the track, and never what the sign shows or was just read as."""
    right = encounter.values | {fact.value}
    listed = allowed_limits(encounter.country, fact.unit) or allowed_limits(None, fact.unit)
    return next(
        value for value in ranked(spec.seed, listed, "misread", encounter.key) if value >= LEAST and value not in right
    )


def _renamed(candidate: Candidate, before: str, after: str) -> Candidate:
    return msgspec.structs.replace(candidate, reading=after) if candidate.reading == before else candidate
