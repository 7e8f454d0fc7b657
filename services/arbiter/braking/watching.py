"""Watching gaps: a track's speed is an estimate, and may be a guess; that the gap really shrinks can be seen."""

from domain import road_users
from proto.perception import Track
from services.arbiter.assessment.assess import gap_m
from services.arbiter.assessment.reading import Reading
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Sighting

KEPT_NS = 700_000_000
SPACING_NS = 40_000_000
"""A picture that follows sooner adds nothing to a rate, and must not push out those that do."""


def watch(sightings: tuple[Sighting, ...], reading: Reading, now_ns: int, profile: Profile) -> tuple[Sighting, ...]:
    """The sightings of the last moments with those of this reading; one picture is one sighting, however often it is read.

    A person that surely comes is watched before the path is reached, so that braking need not wait for it then.
    """
    kept = tuple(each for each in sightings if now_ns - each.stamp_ns <= KEPT_NS)
    if reading.tracks_age_s is None:
        return kept
    stamp_ns = now_ns - round(reading.tracks_age_s * 1e9)
    last = {each.track_id: each.stamp_ns for each in kept}
    return kept + tuple(
        Sighting(track_id=track.track_id, gap_m=gap_m(track, profile), stamp_ns=stamp_ns)
        for track in (*reading.view.actors, *(each for each in reading.coming if _surely(each, profile)))
        if now_ns - stamp_ns <= KEPT_NS and stamp_ns - last.get(track.track_id, 0) >= SPACING_NS
    )


def _surely(person: Track, profile: Profile) -> bool:
    return person.confidence >= profile.act_confidence and person.age_s >= profile.hazard_known_s


def shrinks(sightings: tuple[Sighting, ...], track_id: int, closing_mps: float, profile: Profile) -> bool:
    """Whether the gap to an actor was watched for long enough, and shrank by the share of its closing speed that counts."""
    rate = shrinking_mps(sightings, track_id, profile)
    return rate is not None and rate >= profile.act_shrinks * closing_mps


def contradicted(sightings: tuple[Sighting, ...], track_id: int, closing_mps: float, profile: Profile) -> bool:
    """Whether the gap was watched for long enough, and hardly shrank at all: the claimed speed is wrong."""
    rate = shrinking_mps(sightings, track_id, profile)
    return rate is not None and rate < profile.act_shrinks / 2.0 * closing_mps


def shrinking_mps(sightings: tuple[Sighting, ...], track_id: int, profile: Profile) -> float | None:
    """How fast the gap to an actor really shrank; None: it was not watched for long enough."""
    own = [(each.stamp_ns, each.gap_m) for each in sightings if each.track_id == track_id]
    return road_users.shrinking_mps(own, profile.act_watched_s)
