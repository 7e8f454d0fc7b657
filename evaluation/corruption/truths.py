"""What truth is asked here: which physical sign or actor an observation is of. What is observed never comes from it."""

import math
from collections import deque
from collections.abc import Iterable

from proto.perception import Track
from proto.scene import Fact
from proto.truth import TrueActor, Truth

KEPT = 100
"""Truths of the last five seconds at 20 Hz: a fact tells of a picture that is a little older."""
Sign = dict[str, str | float]
_SIGN = "sign/"


class Truths:
    """The latest truths, and where the drive's time begins."""

    def __init__(self) -> None:
        self._kept: deque[tuple[int, Truth]] = deque(maxlen=KEPT)
        self._origin_ns: int | None = None

    def add(self, truth: Truth, stamp_ns: int) -> None:
        """What is so at a stamp."""
        self._kept.append((stamp_ns, truth))
        if self._origin_ns is None:
            self._origin_ns = stamp_ns - round(truth.time_s * 1e9)

    def at(self, stamp_ns: int) -> Truth | None:
        """The truth nearest to a stamp."""
        if not self._kept:
            return None
        return min(self._kept, key=lambda item: abs(item[0] - stamp_ns))[1]

    @property
    def origin_ns(self) -> int | None:
        """The stamp of the drive's time zero."""
        return self._origin_ns


def sign_of(fact: Fact, signs: Iterable[Sign], bound: str | None = None) -> Sign | None:
    """The sign that a fact is of: the one it was before, unless it can hardly be; else the nearest, if it is near.

    Distances are by a sign's size in the picture, hence often a fifth wrong; more is forgiven where the reading is the sign's.
    """
    if fact.distance_m is None:
        return next((sign for sign in signs if key_of(sign) == bound), None)
    misfits = [(_misfit(fact, sign) - (key_of(sign) == bound), key_of(sign), sign) for sign in signs]
    best = min(misfits, key=lambda item: item[:2], default=None)
    return best[2] if best is not None and best[0] <= 1.5 else None


def key_of(sign: Sign) -> str:
    """The key of a physical sign; the faces of one post share it."""
    return f"{_SIGN}{int(float(sign['id']))}"


def is_true(key: str) -> bool:
    """Whether a key is one that truth gave."""
    return key.startswith(_SIGN)


def values_of(sign: Sign) -> frozenset[float]:
    """The numbers that a sign shows."""
    tails = (code.partition(":")[2] for code in str(sign["code"]).split("+"))
    return frozenset(float(tail) for tail in tails if tail.isdigit())


def _misfit(fact: Fact, sign: Sign) -> float:
    """0: the same place and reading."""
    distance_m = fact.distance_m or 0.0
    ahead = (distance_m - float(sign["x_m"])) / (4.0 + 0.2 * abs(distance_m))
    aside = 0.0 if fact.lateral_m is None else (fact.lateral_m - float(sign["y_m"])) / (3.0 + 0.05 * abs(distance_m))
    apart = math.hypot(ahead, aside)
    return apart / 2 if fact.reading in str(sign["code"]).split("+") else apart + 0.5


def actor_of(track: Track, actors: Iterable[TrueActor], bound: str | None = None) -> str | None:
    """The key of the actor that a track is of: the one it was before, unless it can hardly be; else the nearest."""
    misfits = [(_apart(track, actor) - (_key(actor) == bound), _key(actor)) for actor in actors]
    best = min(misfits, default=None)
    return best[1] if best is not None and best[0] <= 1.0 else None


def _key(actor: TrueActor) -> str:
    return f"actor/{actor.actor_id}"


def _apart(track: Track, actor: TrueActor) -> float:
    other_kind = (track.kind == "pedestrian") != (actor.kind == "pedestrian")
    reach = 2.5 + 0.1 * abs(track.x_m)
    return math.hypot((track.x_m - actor.x_m) / reach, (track.y_m - actor.y_m) / 2.5) + other_kind
