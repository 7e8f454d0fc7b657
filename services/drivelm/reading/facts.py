"""From a track's belief to the fact that is published."""

from typing import NamedTuple

from proto.scene import Candidate, Fact, Scope
from services.drivelm.reading.evidence import Belief
from services.drivelm.reading.sign_tracks import SignTrack
from services.drivelm.vocabulary.classes import OTHER, SENTENCES
from services.drivelm.vocabulary.jurisdictions import unit_of_sign
from services.drivelm.vocabulary.parser import Statement, admitted, statement_of

LANE_WIDTH_M = 3.5


class Here(NamedTuple):
    """What else is known at the moment: the country, the ego's lane, and what a map calls the road (empty: no map)."""

    jurisdiction: str | None = None
    ego_lane_id: str = ""
    lateral_offset_m: float = 0.0
    lane_width_m: float = LANE_WIDTH_M
    road_class: str = ""


def fact_of(track: SignTrack, here: Here, *, passed: bool = False) -> Fact | None:
    """The fact of a track: believed, or a doubted candidate; None where there is nothing worth saying."""
    best = track.belief()
    statement = statement_of(best.reading)
    stands_there = track.grew or not passed
    believed = track.believed(best) and stands_there and admitted(statement, here.jurisdiction)
    if statement.kind == "plate" or not (believed or track.doubted(best)) or best.reading == OTHER:
        return None
    plates = (*_OWN_PLATES.get(best.reading.partition(":")[0], ()), *track.plates())
    return Fact(
        kind=statement.kind,
        reading=public_code(best.reading),
        confidence=round(best.probability, 4) if admitted(statement, here.jurisdiction) else 0.0,
        frame_stamp_ns=track.seen_ns,
        track_id=track.track_id,
        camera=track.camera,
        value=statement.value,
        unit=statement.unit or (unit_of_sign(here.jurisdiction, best.reading) if statement.value is not None else None),
        scope=_scope(statement, plates),
        believed=believed,
        distance_m=_ahead(track),
        lateral_m=round(track.place.lateral_m, 2) if track.place else None,
        candidates=() if believed else _candidates(best),
        plates=plates,
        sentence=SENTENCES.get(best.reading, ""),
        lane_id=_lane(track, best.reading, here) if best.reading.startswith("led:") else "",
        disc_px=round(track.region.height_px, 1),
        passed=passed,
    )


def public_code(reading: str) -> str:
    """The code that others know: how a country draws a sign matters only for telling the country."""
    head, colon, tail = reading.partition(":")
    if head.startswith("town_"):
        return head
    return f"{_SAME[head]}{colon}{tail}" if head in _SAME else reading


_SAME = {"limit_board": "limit", "school_limit": "limit", "general": "limit", "general_end": "limit_end"}
_OWN_PLATES = {"school_limit": ("plate:school",)}
"""What a sign says on itself and others say on a plate: a limit of school hours stands beside the others."""


def _scope(statement: Statement, plates: tuple[str, ...]) -> Scope:
    if any(plate.startswith("plate:when_wet") for plate in plates) and statement.scope == "permanent":
        return "when_wet"
    if "plate:end" in plates and statement.kind == "limit":
        return "end"
    return statement.scope


def _candidates(best: Belief) -> tuple[Candidate, ...]:
    return tuple(
        Candidate(reading=public_code(reading), confidence=round(share, 4))
        for reading, share in best.ranked
        if reading != OTHER and share >= 0.02
    )


def _ahead(track: SignTrack) -> float | None:
    return round(track.place.distance_m - track.travelled_m, 1) if track.place else None


def _lane(track: SignTrack, reading: str, here: Here) -> str:
    """The lane below a panel: the ego's lane by name, others by their offset (`offset:+1` is one to the left).

    A panel that lifts something (blank, end, open lane) counts for the ego's lane only when it hangs well over it.
    """
    if track.place is None:
        return ""
    lanes_left = (track.place.lateral_m + here.lateral_offset_m) / here.lane_width_m
    reach = 0.3 if reading in _LIFTING else 0.5
    return here.ego_lane_id if abs(lanes_left) <= reach else f"offset:{lanes_left:+.1f}"


_LIFTING = frozenset({"led:blank", "led:end", "led:lane_open"})
