"""Which facts are of one physical sign, over both cameras and over tracks that change their number.

By truth where there is one. Without: facts of one track are of one sign, and so are tracks that within `TOGETHER_NS` stand at
one place, by the way driven meanwhile. Two signs less than a few metres apart on one side count as one then; a sign whose
second track comes later, or one without a distance, as two.
"""

from typing import NamedTuple

from evaluation.corruption.limits import Encounter
from evaluation.corruption.truths import Sign, Truths, is_true, key_of, sign_of, values_of
from proto.scene import Fact

TOGETHER_NS = 3_000_000_000
Number = tuple[str, int]
"""Camera and track."""


class _Standing(NamedTuple):
    encounter: Encounter
    at_m: float | None
    """Along the way driven."""
    aside_m: float
    seen_ns: int
    number: Number
    """The track that was of it last."""


class Encounters:
    """Give facts in the order of their stamps, so that the first track names an encounter that truth does not."""

    def __init__(self, truths: Truths) -> None:
        self._truths = truths
        self._bound: dict[Number, str] = {}
        self._standing: dict[str, _Standing] = {}
        self._travelled_m = 0.0
        self._moved_ns: int | None = None
        self._country: str | None = None

    def move(self, speed_mps: float, now_ns: int) -> None:
        """Count the way driven since the last call."""
        since_ns = 0 if self._moved_ns is None else max(0, now_ns - self._moved_ns)
        self._travelled_m += max(0.0, speed_mps) * since_ns / 1e9
        self._moved_ns = now_ns

    def country(self, code: str) -> None:
        """The country believed from now on."""
        self._country = code

    def of(self, fact: Fact) -> Encounter:
        """The encounter that a fact belongs to."""
        number = (fact.camera, fact.track_id)
        sign = self._sign(fact, self._bound.get(number))
        if sign is not None:
            key = key_of(sign)
            encounter = Encounter(key, values_of(sign), str(sign.get("country") or "") or self._country)
        else:
            key = self._bound.get(number) or self._beside(fact) or f"{fact.camera or 'camera'}/{fact.track_id}"
            encounter = self._known(key) or Encounter(key, frozenset(_values(fact)), self._country)
        self._bound[number] = key
        at_m = None if fact.distance_m is None else self._travelled_m + fact.distance_m
        self._standing[key] = _Standing(encounter, at_m, fact.lateral_m or 0.0, fact.frame_stamp_ns, number)
        return encounter

    def _sign(self, fact: Fact, bound: str | None) -> Sign | None:
        """By truth; a track that began without one goes on so, and what is passed is what it was on the way."""
        truth = self._truths.at(fact.frame_stamp_ns)
        if truth is None or (bound is not None and (fact.passed or not is_true(bound))):
            return None
        return sign_of(fact, truth.signs, bound)

    def _known(self, key: str) -> Encounter | None:
        return self._standing[key].encounter if key in self._standing else None

    def _beside(self, fact: Fact) -> str | None:
        """Another track's sign that stands where this one does."""
        if fact.distance_m is None:
            return None
        at_m, room_m = self._travelled_m + fact.distance_m, 4.0 + 0.2 * abs(fact.distance_m)
        near = [
            (abs(each.at_m - at_m), key)
            for key, each in self._standing.items()
            if each.at_m is not None
            and abs(each.at_m - at_m) <= room_m
            and abs(each.aside_m - (fact.lateral_m or 0.0)) <= 3.0
            and abs(each.seen_ns - fact.frame_stamp_ns) <= TOGETHER_NS
            and not _in_one_picture(each, fact)
        ]
        return min(near)[1] if near else None


def _in_one_picture(standing: _Standing, fact: Fact) -> bool:
    """Two tracks of one picture are two signs."""
    same_camera, same_picture = standing.number[0] == fact.camera, standing.seen_ns == fact.frame_stamp_ns
    return same_camera and same_picture and standing.number[1] != fact.track_id


def _values(fact: Fact) -> tuple[float, ...]:
    return () if fact.value is None else (fact.value,)
