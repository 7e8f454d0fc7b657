"""Signs missed and limits misread, by encounter: the same all along the track, whichever camera sees it."""

import msgspec

from evaluation.corruption.chance import chance
from evaluation.corruption.encounters import Encounters
from evaluation.corruption.limits import Encounter, misread, readable
from evaluation.corruption.spec import CorruptionSpec
from proto.scene import Fact, Facts
from proto.truth import Corrupted, CorruptionKind

MISSABLE = ("limit", "sign", "message")
"""Kinds of facts that come from one sign. A light is not a sign, nor is what follows from many signs (country, units)."""


def missed(spec: CorruptionSpec, encounter: Encounter) -> bool:
    """Whether the sign is missed, from its first fact to its last."""
    return chance(spec.seed, "sign_miss", encounter.key) < spec.sign_miss


def is_misread(spec: CorruptionSpec, encounter: Encounter) -> bool:
    """Whether the sign's number or unit is read wrongly, from its first fact to its last."""
    return chance(spec.seed, "limit_misread", encounter.key) < spec.limit_misread


class Signs:
    """Corrupts facts. The identity of signs is `encounters`'s matter."""

    def __init__(self, spec: CorruptionSpec, encounters: Encounters) -> None:
        self._spec, self._encounters = spec, encounters
        self._told: set[tuple[CorruptionKind, str]] = set()

    def facts(self, facts: Facts, stamp_ns: int) -> tuple[Facts | None, list[Corrupted]]:
        """The facts that are left, as they are read; None where none is. Untouched facts come back as the same object."""
        records: list[Corrupted] = []
        left = tuple(after for fact in facts.facts if (after := self._one(fact, stamp_ns, records)) is not None)
        if len(left) == len(facts.facts) and all(a is b for a, b in zip(left, facts.facts, strict=True)):
            return facts, records
        return (msgspec.structs.replace(facts, facts=left) if left else None), records

    def _one(self, fact: Fact, stamp_ns: int, records: list[Corrupted]) -> Fact | None:
        if fact.kind == "jurisdiction" and fact.believed:
            self._encounters.country(fact.reading)
        if fact.kind not in MISSABLE:
            return fact
        encounter = self._encounters.of(fact)
        if self._told_of("sign_miss", missed(self._spec, encounter), encounter, fact, fact, stamp_ns, records):
            return None
        if not readable(fact) or not self._spec.limit_misread:
            return fact
        after = misread(self._spec, fact, encounter)
        hit = self._told_of(
            "limit_misread", is_misread(self._spec, encounter), encounter, fact, after, stamp_ns, records
        )
        return after if hit else fact

    def _told_of(
        self, kind: CorruptionKind, hit: bool, encounter: Encounter, before: Fact, after: Fact, stamp_ns: int,
        records: list[Corrupted],
    ) -> bool:  # fmt: skip
        """`hit`, told once per encounter where that kind is asked for."""
        if getattr(self._spec, kind) > 0 and (kind, encounter.key) not in self._told:
            self._told.add((kind, encounter.key))
            shown = "" if not hit or kind == "sign_miss" else _words(after)
            told = Corrupted(
                kind=kind, subject=encounter.key, stamp_ns=stamp_ns, hit=hit, camera=before.camera,
                track_id=before.track_id, before=_words(before), after=shown,
            )  # fmt: skip
            records.append(told)
        return hit


def _words(fact: Fact) -> str:
    return f"{fact.reading} {fact.unit}" if fact.unit else fact.reading
