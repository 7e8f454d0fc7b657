"""Whole approaches in photographs: the pictures of one track through the front end, as on the road."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from proto.perception import Box
from services.drivelm.backends.backend import EmbeddedBackend
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.reading.facts import public_code
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import OTHER
from training.photographs.gtsrb import RealSign

STEP_NS = 100_000_000
"""The pictures of a track are spread over an approach and have no times: a tenth of a second each."""


class Approach(NamedTuple):
    """One track: its class, how large the sign got, and all that was believed of it, in order."""

    label: str
    number: int
    largest_px: float
    beliefs: tuple[str, ...]


def driven(reader: Reader, signs: Iterable[RealSign], home: str = "") -> list[Approach]:
    """Drive past every track of the signs; signs of no track are left out."""
    tracks: dict[tuple[int, int], list[RealSign]] = defaultdict(list)
    for sign in signs:
        if sign.track is not None:
            tracks[sign.number, sign.track].append(sign)
    return [_approach(reader, sorted(each, key=lambda sign: sign.frame), home) for each in tracks.values()]


def _approach(reader: Reader, track: Sequence[RealSign], home: str) -> Approach:
    end, beliefs = FrontEnd(EmbeddedBackend(reader), home=home), []
    for index, sign in enumerate(track):
        x0, y0, x1, y1 = sign.region
        box = Box(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind="sign", score=0.9, track_id=1)
        sighting = Sighting(camera="front", stamp_ns=(index + 1) * STEP_NS, boxes=(box,), open_picture=sign.picture)
        end.see(sighting)
        track_now = end.tracks.get(("front", 1))
        if track_now is not None and track_now.believed(best := track_now.belief()):
            beliefs.append(public_code(best.reading))
    largest = max(sign.region.height_px for sign in track)
    return Approach(public_code(track[0].label), track[0].number, largest, tuple(beliefs))


def table(approaches: Sequence[Approach]) -> dict[str, Any]:
    """Shares believed right at the last, ever believed wrong and ever believed higher; of unknown signs, ever believed known."""
    limits = [each for each in approaches if each.label.startswith("limit:")]
    known = [each for each in approaches if each.label != OTHER]
    unknown = [each for each in approaches if each.label == OTHER]
    return {
        "approaches": len(approaches),
        "limits": _row(limits),
        "known": _row(known),
        "unknown": {
            "approaches": len(unknown),
            "ever believed known": _share([bool(each.beliefs) for each in unknown]),
        },
        "mistakes": dict(Counter(_mistake(each) for each in approaches if _wrong(each)).most_common()),
    }


def _row(driven: Sequence[Approach]) -> dict[str, Any]:
    return {
        "approaches": len(driven),
        "believed right": _share([each.beliefs[-1:] == (each.label,) for each in driven]),
        "ever believed wrong": _share([_wrong(each) for each in driven]),
        "ever believed higher": _share(
            [any(_value(belief) > _value(each.label) for belief in each.beliefs) for each in driven]
        ),
    }


def _wrong(each: Approach) -> bool:
    return any(belief != each.label for belief in each.beliefs)


def _mistake(each: Approach) -> str:
    said = "/".join(dict.fromkeys(belief for belief in each.beliefs if belief != each.label))
    return f"{each.label} ({each.number}) as {said}"


def _value(reading: str) -> int:
    """The number of a limit; of everything else 0, so that it is higher than nothing but another limit's is."""
    head, _, tail = reading.partition(":")
    return int(tail) if head == "limit" and tail.isdigit() else 0


def _share(flags: Sequence[bool]) -> float | None:
    return round(sum(flags) / len(flags), 4) if flags else None
