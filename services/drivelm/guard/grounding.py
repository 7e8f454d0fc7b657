"""The grounding guard: what is said of a picture counts only as far as picture, sign reader and map bear it out.

Three kinds of support are weighed for each fact. Two are how its track's answers stood the checks (`spoken`), and
whether the backend's answers depend on pictures at all (`probes`). The third, beside a backend other than the embedded
one, is whether the embedded sign reader and the map agree. What lacks support loses confidence or belief, and `Fact.grounding` says why.
A fact below the confidence that raising or ending a limit needs can still lower one.
"""

from typing import NamedTuple

import msgspec

from proto.scene import Candidate, Fact, Unit
from services.drivelm.guard.probes import Probes
from services.drivelm.vocabulary.classes import LIGHTS

Key = tuple[str, int]
UNSURE = 0.55
"""Confidence left to what lacks support: enough to lower a limit (0.3), not to raise or end one (0.6)."""
HELD = 0.5
"""Factor on the confidence of what is held: no longer believed, a doubt."""
MOST_STRIKES = 3
CONFIRMS = 0.5
"""Confidence from which the sign reader's reading of the same counts as agreement."""
SAID_IDS = 2_000_000_000
"""Added to the track's number where a backend's reading stands beside the sign reader's as a doubt of its own."""
BLIND = "the answers do not change with the picture"
ALONE = "read by the sign reader alone"
UNCONFIRMED = "the sign reader has not confirmed it"
HIGHEST_KMH = {"living_street": 30.0, "urban": 80.0, "rural": 115.0}
"""Above these a limit is implausible on such a road of the map; 70 mph on a British rural road is 113 km/h."""
CAREFUL = frozenset({"stop", "yield", "no_entry", "town_entry", "calm_street"}) | {
    label for label in LIGHTS if label.startswith(("light:red", "light:amber"))
}
"""What the sign reader sees of these stays as sure as it is, whatever else is read there."""
KMH: dict[Unit | None, float] = {"km/h": 1.0, "mph": 1.609344, None: 1.0}
"""Of a unit as posted; what names none is taken for km/h."""


class Grounds(NamedTuple):
    """What speaks against the answers on one track: faults not yet made good, and a probe that changed nothing."""

    strikes: int = 0
    fault: str = ""
    unmoved: str = ""

    @property
    def against(self) -> str:
        """In words; empty: nothing."""
        return self.unmoved or (self.fault if self.strikes else "")


class Guard:
    """The grounds of all tracks, and the probes of one backend."""

    def __init__(self) -> None:
        self.grounds: dict[Key, Grounds] = {}
        self.probes = Probes()

    def note(self, key: Key, fault: str) -> None:
        """An answer on a track; with a fault it counts against the track, without one it makes good an earlier one."""
        before = self.grounds.get(key, Grounds())
        strikes = min(MOST_STRIKES, before.strikes + 1) if fault else max(0, before.strikes - 1)
        if fault or before.strikes:
            self.grounds[key] = before._replace(strikes=strikes, fault=fault or before.fault)

    def probed(self, key: Key, what: str, *, changed: bool) -> None:
        """How a probe on a track came out."""
        before = self.grounds.get(key, Grounds())
        if not changed or before.unmoved:
            self.grounds[key] = before._replace(unmoved="" if changed else f"the same answer to {what}")

    def renamed(self, key: Key, new: Key) -> None:
        """A track goes on under another number."""
        if (grounds := self.grounds.pop(key, None)) is not None:
            self.grounds[new] = grounds

    def forget(self, key: Key) -> None:
        """A track is gone."""
        self.grounds.pop(key, None)

    def own(self, key: Key, fact: Fact | None) -> Fact | None:
        """The backend's own fact, weighed by its track's grounds and by its probes."""
        if fact is None:
            return None
        if not self.probes.stands:
            return held(fact, BLIND)
        against = self.grounds.get(key, Grounds()).against
        return held(fact, against) if against else fact


def weighed(mine: Fact | None, theirs: Fact | None, road_class: str, *, nothing_there: bool) -> tuple[Fact, ...]:
    """The facts of one track from a backend's own fact and the sign reader's.

    Where both agree, the sign reader's, which is the newer one, or the one that is believed. Where they contradict each
    other, the backend's as a doubt of its own, beside the sign reader's: in full where that is the more careful of the
    two, else too unsure to raise anything.
    `nothing_there`: the sign reader is sure to see no sign.
    """
    if mine is None or theirs is None:
        return _one_sided(mine, theirs, road_class, nothing_there=nothing_there)
    if mine.grounding == BLIND or (mine.grounding and same(mine, theirs)):
        return (remarked(theirs, f"{ALONE}: {mine.grounding}"),)
    if same(mine, theirs):
        confirmed = theirs.believed or theirs.confidence >= CONFIRMS
        agreed = theirs if theirs.believed else mine
        return (on_map(agreed if confirmed else unsure(agreed, UNCONFIRMED), road_class),)
    doubt = msgspec.structs.replace(mine, track_id=mine.track_id + SAID_IDS)
    said, read = f"the backend reads {_named(mine)}", f"the sign reader reads {_named(theirs)}"
    return (
        remarked(theirs, said) if stands_against(theirs, mine) else unsure(theirs, said),
        held(on_map(doubt, road_class), read, _candidates(mine, theirs)),
    )


def _one_sided(mine: Fact | None, theirs: Fact | None, road_class: str, *, nothing_there: bool) -> tuple[Fact, ...]:
    if theirs is not None:
        return (remarked(theirs, ALONE),)
    if mine is None:
        return ()
    mine = on_map(mine, road_class)
    return (held(mine, "the sign reader sees no sign there") if nothing_there else unsure(mine, UNCONFIRMED),)


def stands_against(theirs: Fact, mine: Fact) -> bool:
    """Whether the sign reader's fact is no less careful than the other: it is then not made unsure by it."""
    if theirs.reading in CAREFUL:
        return True
    if theirs.kind != "limit" or mine.kind != "limit" or theirs.scope == "end" or theirs.value is None or theirs.plates:
        return False
    lifts = mine.value is None or mine.scope == "end"
    return lifts or (mine.unit == theirs.unit and theirs.value <= (mine.value or 0.0))


def same(mine: Fact, theirs: Fact) -> bool:
    """Whether both say the same, plates and scope included: a plate makes a limit count for less."""
    return (mine.reading, mine.scope, mine.plates) == (theirs.reading, theirs.scope, theirs.plates)


def on_map(fact: Fact, road_class: str) -> Fact:
    """The fact, held where it shows a higher limit than such a road of the map can have."""
    highest = HIGHEST_KMH.get(road_class)
    if highest is None or fact.value is None or fact.value * KMH.get(fact.unit, 1.0) <= highest:
        return fact
    return held(fact, f"the map says {road_class}: no limit above {highest:g} km/h")


def held(fact: Fact, why: str, candidates: tuple[Candidate, ...] = ()) -> Fact:
    """A doubt in place of a belief; it can lower, and raises or ends nothing."""
    shown = candidates or fact.candidates or (Candidate(reading=fact.reading, confidence=fact.confidence),)
    confidence = round(HELD * fact.confidence, 4)
    return remarked(msgspec.structs.replace(fact, believed=False, confidence=confidence, candidates=shown), why)


def unsure(fact: Fact, why: str) -> Fact:
    """Believed enough to lower something; an unconfirmed condition makes it no weaker."""
    scope = "permanent" if fact.scope == "when_wet" else fact.scope
    confidence = min(fact.confidence, UNSURE)
    return remarked(msgspec.structs.replace(fact, confidence=confidence, scope=scope, plates=()), why)


def remarked(fact: Fact, why: str) -> Fact:
    """With one more reason for its confidence."""
    return msgspec.structs.replace(fact, grounding="; ".join(filter(None, (fact.grounding, why))))


def _named(fact: Fact) -> str:
    return " ".join((fact.reading, *fact.plates))


def _candidates(mine: Fact, theirs: Fact) -> tuple[Candidate, ...]:
    return tuple(Candidate(reading=each.reading, confidence=each.confidence) for each in (mine, theirs))
