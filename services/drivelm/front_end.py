"""The front end as a value machine: boxes of a picture in, facts out; it knows no bus and reads no clock."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import msgspec

from proto.perception import Box
from proto.scene import Fact
from proto.sensors import Calibration
from services.drivelm import geometry, plates, zones
from services.drivelm.backend import Answer, Backend
from services.drivelm.crops import Picture, Region, crop
from services.drivelm.cues import Whereabouts, cues_of
from services.drivelm.facts import Here, fact_of
from services.drivelm.jurisdictions import has_boards, unit_of
from services.drivelm.names import TownNames
from services.drivelm.parser import parse
from services.drivelm.sentences import QUESTIONS
from services.drivelm.tracks import CONTRARY_FRAMES, SignTrack

MIN_PX = 9.0
"""Boxes lower than this are not worth reading."""
PLATE_FROM_PX = 14.0
REPEAT_NS = 500_000_000
"""How often a fact is said again while its track is in sight; lights are said with every frame."""
GONE_NS = 8_000_000_000
UNSEEN_NS = 350_000_000
"""A track not seen for this long is on its way past."""
GHOST_IDS = 1_000_000_000
"""Numbers above this belong to things whose track went over to something else."""
_LIGHT_GONE_NS = 1_000_000_000
KINDS = ("light", "panel", "sign")
Key = tuple[str, int]
Readings = tuple[tuple[str, float], ...]
ROAD_TYPES = {"motorway": "motorway", "motorway_end": "rural", "town_entry": "urban", "town_exit": "rural"}
"""Which kind of road begins behind a sign."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """One picture's boxes. ``open_picture`` decodes the picture, and is called only if something is to be read."""

    camera: str
    stamp_ns: int
    boxes: Sequence[Box]
    open_picture: Callable[[], Picture | None]
    calibration: Calibration | None = None


@dataclass(frozen=True, slots=True)
class _Look:
    """One crop to be read, and for whom."""

    key: Key
    question: str
    image: Picture
    region: Region
    closer: Picture | None = None
    """The ring of a zone sign, for a second look."""


class FrontEnd:
    """Keeps the tracks, asks the backend, parses, fuses, and says facts when they change."""

    def __init__(self, backend: Backend, *, home: str = "", max_reads: int = 8, names: TownNames | None = None) -> None:
        self.backend, self.max_reads, self.names = backend, max_reads, names
        self.tracks: dict[Key, SignTrack] = {}
        self.whereabouts = Whereabouts.at_home(home)
        self.here = Here(jurisdiction=self.whereabouts.believed)
        self.road_type: tuple[str, float] | None = None
        """The kind of road that the last deciding sign told of, and how sure that sign was."""
        self._ghosts = 0

    def see(self, sighting: Sighting) -> tuple[Fact, ...]:
        """Read what is worth reading in a picture; facts that are new, changed or due."""
        chosen = self._chosen(sighting)
        self._note_unread(sighting, {box.track_id for box in chosen})
        picture = sighting.open_picture() if chosen else None
        looks = self._looks(sighting, chosen, picture) if picture is not None else []
        for question in dict.fromkeys(look.question for look in looks):
            part = [look for look in looks if look.question == question]
            for look, readings in zip(part, self._answers(part, question), strict=True):
                self._take(look, readings, sighting.stamp_ns)
        seen = [
            key
            for key, track in self.tracks.items()
            if key[0] == sighting.camera and track.seen_ns == sighting.stamp_ns
        ]
        for key in seen:
            self._locate(key, sighting)
            self._ask_name(key, picture)
        return tuple(fact for key in seen if (fact := self._said(key, sighting.stamp_ns)) is not None)

    def _answers(self, looks: Sequence[_Look], question: str) -> list[Readings]:
        """The readings of all looks that ask one question; a zone's number comes from a closer look at its ring."""
        images = [look.image for look in looks] + [look.closer for look in looks if look.closer is not None]
        readings = [ranked(answer, self.here.jurisdiction) for answer in self.backend.answer(images, question)]
        closer = iter(readings[len(looks) :])
        return [
            zones.sharpened(whole, next(closer) if look.closer is not None else ())
            for look, whole in zip(looks, readings, strict=False)
        ]

    def settle(self, now_ns: int, speed_mps: float | None) -> tuple[Fact, ...]:
        """Let time pass: tracks out of sight move towards the ego, are passed, or are forgotten."""
        said = []
        for key, track in list(self.tracks.items()):
            unseen_ns = now_ns - track.seen_ns
            moved = track.moved(now_ns, speed_mps if speed_mps is not None else 0.0)
            self.tracks[key] = moved
            if unseen_ns < UNSEEN_NS:
                continue
            if key[1] > GHOST_IDS:
                said.append(self._said(key, track.seen_ns))
            if moved.kind != "light" and _is_behind(moved, speed_mps, unseen_ns):
                said.append(self._passed(key))
            elif unseen_ns > (_LIGHT_GONE_NS if moved.kind == "light" else GONE_NS):
                del self.tracks[key]
        return tuple(fact for fact in said if fact is not None)

    def _chosen(self, sighting: Sighting) -> list[Box]:
        """The boxes to read: lights first, then what is not settled, then the largest."""
        readable = [
            box for box in sighting.boxes if box.kind in KINDS and box.track_id and box.y1_px - box.y0_px >= MIN_PX
        ]
        return sorted(readable, key=lambda box: self._rank(sighting.camera, box))[: self.max_reads]

    def _rank(self, camera: str, box: Box) -> tuple[bool, bool, float]:
        return box.kind != "light", self._settled((camera, box.track_id)), box.y0_px - box.y1_px

    def _settled(self, key: Key) -> bool:
        track = self.tracks.get(key)
        return track is not None and track.settled

    def _note_unread(self, sighting: Sighting, reading: set[int]) -> None:
        """Tracks in sight that are not read this time are still in sight."""
        for box in sighting.boxes:
            key = (sighting.camera, box.track_id)
            if box.track_id not in reading and key in self.tracks:
                self.tracks[key] = _in_sight(self.tracks[key], _region(box), sighting.stamp_ns)

    def _looks(self, sighting: Sighting, boxes: Sequence[Box], picture: Picture) -> list[_Look]:
        signs, boards = [_region(box) for box in boxes if box.kind == "sign"], has_boards(self.here.jurisdiction)
        looks: list[_Look] = []
        for box in boxes:
            if len(looks) >= self.max_reads:
                break
            key, region = (sighting.camera, box.track_id), _region(box)
            self._open(key, box.kind, region, sighting.stamp_ns)
            own, hung = plates.split(region, boards=boards) if box.kind == "sign" else (region, None)
            if (image := crop(picture, own)) is not None:
                looks.append(_Look(key, QUESTIONS[box.kind], image, own, self._closer(key, picture, own)))
            if hung is None or own.height_px < PLATE_FROM_PX or len(looks) >= self.max_reads:
                continue
            others = [other for other in signs if other != region]
            under = plates.below(own, others)
            plate = hung if under is None else others[under]
            if (image := crop(picture, plate)) is not None:
                looks.append(_Look(key, QUESTIONS["plate"], image, plate))
        return looks

    def _closer(self, key: Key, picture: Picture, region: Region) -> Picture | None:
        is_zone = self.tracks[key].belief().reading.startswith(zones.HEAD)
        return crop(picture, zones.ring(region)) if is_zone else None

    def _open(self, key: Key, kind: str, region: Region, stamp_ns: int) -> None:
        if key not in self.tracks:
            self.tracks[key] = SignTrack(
                camera=key[0], track_id=key[1], kind=kind, first_ns=stamp_ns, seen_ns=stamp_ns, region=region
            )

    def _take(self, look: _Look, readings: Readings, stamp_ns: int) -> None:
        track = self.tracks[look.key]
        if look.question == QUESTIONS["plate"]:
            self.tracks[look.key] = track.read_plate(readings, look.region.width_px)
        elif track.contradicted(readings):
            self._take_contrary(look, readings, stamp_ns)
        elif readings:
            self.tracks[look.key] = track.read(readings, look.region, stamp_ns)
        else:
            self.tracks[look.key] = _in_sight(track, look.region, stamp_ns)

    def _take_contrary(self, look: _Look, readings: Readings, stamp_ns: int) -> None:
        """The track may have jumped to another thing: wait for a second such frame, then part the two.

        What was believed goes on under a number of its own, out of sight, until it is passed.
        """
        track = self.tracks[look.key]
        if track.contrary + 1 < CONTRARY_FRAMES:
            self.tracks[look.key] = replace(track, contrary=track.contrary + 1)
            return
        self._ghosts += 1
        ghost = (track.camera, GHOST_IDS + self._ghosts)
        self.tracks[ghost] = replace(track, track_id=ghost[1], contrary=0, said=())
        del self.tracks[look.key]
        self._open(look.key, track.kind, look.region, stamp_ns)
        self.tracks[look.key] = self.tracks[look.key].read(readings, look.region, stamp_ns)

    def _locate(self, key: Key, sighting: Sighting) -> None:
        if sighting.calibration is None:
            return
        track = self.tracks[key]
        measured = next(
            (box.range_m for box in sighting.boxes if box.track_id == key[1] and box.range_source == "lidar"), None
        )
        seen = geometry.place(track.region, _shape(track), sighting.calibration, measured)
        place = geometry.smoothed(track.place, track.travelled_m, seen)
        self.tracks[key] = replace(track, place=place, travelled_m=0.0)

    def _learn(self, key: Key, track: SignTrack) -> None:
        """Count a believed sign as a cue of the country, once it is passed: what is ahead may stand beyond a border."""
        best = track.belief()
        if not track.believed(best):
            return
        if best.reading.startswith("border:"):
            self.believe(self.whereabouts.past_border(key, best.reading.partition(":")[2]))
            return
        where = self.whereabouts.with_cue(key, cues_of(best.reading))
        for plate in track.plates():
            where = where.with_cue((f"{key[0]}/plate", key[1]), cues_of(plate))
        self.believe(where)

    def _ask_name(self, key: Key, picture: Picture | None) -> None:
        track = self.tracks[key]
        if self.names is None or picture is None or not self.names.wants(key, track.region.height_px):
            return
        best = track.belief()
        if best.reading.startswith("town_") and track.believed(best):
            x0, y0, x1, y1 = (max(0, round(edge)) for edge in track.region)
            self.names.ask(key, picture[y0:y1, x0:x1])

    def _named(self, key: Key, fact: Fact | None) -> Fact | None:
        if fact is None or self.names is None or not fact.reading.startswith("town_"):
            return fact
        return msgspec.structs.replace(fact, text=self.names.name(key))

    def believe(self, where: Whereabouts) -> None:
        """Take over a belief about the country."""
        self.whereabouts = where
        self.here = self.here._replace(
            jurisdiction=where.believed, jurisdiction_confidence=where.posterior(where.believed)
        )

    def _said(self, key: Key, stamp_ns: int) -> Fact | None:
        track = self.tracks[key]
        fact = self._named(key, fact_of(track, self.here))
        if fact is None:
            return None
        content = (fact.reading, fact.believed, fact.scope, fact.plates, fact.unit, fact.text)
        due = stamp_ns - track.said_ns >= REPEAT_NS or track.kind == "light"
        if content == track.said and not due:
            return None
        self.tracks[key] = replace(track, said=content, said_ns=stamp_ns)
        return fact

    def _passed(self, key: Key) -> Fact | None:
        track = self.tracks.pop(key)
        fact = self._named(key, fact_of(track, self.here, passed=True))
        self._learn(key, track)
        if fact is not None and fact.believed and fact.reading in ROAD_TYPES:
            self.road_type = (ROAD_TYPES[fact.reading], fact.confidence)
        return fact


def ranked(answer: Answer, jurisdiction: str | None) -> Readings:
    """An answer as readings with probabilities; what the parser refuses is no reading at all.

    A sentence in a unit that the country does not use is refused too. A condition said in the sentence itself is not
    kept: conditions come from plates, and without one a limit counts always, which is the careful side.
    """
    offered = answer.alternatives or ((answer.text, answer.score),)
    parsed = ((parse(text), share) for text, share in offered if text)
    readings: dict[str, float] = {}
    for statement, share in parsed:
        if statement is not None and statement.unit in (None, unit_of(jurisdiction)):
            readings[statement.reading] = max(readings.get(statement.reading, 0.0), share)
    return tuple(readings.items())


def _region(box: Box) -> Region:
    return Region(box.x0_px, box.y0_px, box.x1_px, box.y1_px)


def _in_sight(track: SignTrack, region: Region, stamp_ns: int) -> SignTrack:
    return replace(track, region=region, seen_ns=stamp_ns)


def _shape(track: SignTrack) -> str:
    best = track.belief()
    return {"light": "light:off", "panel": "led:blank"}.get(track.kind, best.reading)


def _is_behind(track: SignTrack, speed_mps: float | None, unseen_ns: int) -> bool:
    """Whether the ego has driven past. Without a speed: a restriction counts as passed after three seconds out of
    sight, an end of a restriction never."""
    if speed_mps is None:
        return unseen_ns > 3_000_000_000 and track.belief().reading not in _ENDS
    return track.place is not None and track.travelled_m >= track.place.distance_m


_ENDS = frozenset(
    {
        "limit_end", "all_end", "zone_end", "national", "led:end", "no_overtaking_end", "general_end", "school_end",
        "town_exit", *(f"town_exit:{ground}" for ground in ("yellow", "white", "dark")),
    }
)  # fmt: skip
