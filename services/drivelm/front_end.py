"""The front end as a value machine: boxes of a picture in, facts out; it knows no bus and reads no clock."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from proto.perception import Box
from proto.scene import Fact
from proto.sensors import Calibration
from services.drivelm.backends.backend import Answer, Backend
from services.drivelm.country.country_belief import CountryBelief, cues_of
from services.drivelm.guard import answer_checks, grounding
from services.drivelm.guard.answer_checks import Readings, Shown
from services.drivelm.guard.probes import Probe, Settled
from services.drivelm.ocr.lettering import Lettering
from services.drivelm.reading import plates, sign_look, sign_position
from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.reading.evidence import Evidence
from services.drivelm.reading.facts import Here, fact_of
from services.drivelm.reading.sign_tracks import CONTRARY_FRAMES, DoubtedLights, SignTrack
from services.drivelm.vocabulary.classes import OTHER, QUESTIONS
from services.drivelm.vocabulary.jurisdictions import has_boards

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
NOTHING_THERE = 0.9
"""Posterior from which the sign reader is sure that there is no sign."""
Key = tuple[str, int]
ROAD_TYPES = {"motorway": "motorway", "motorway_end": "rural", "town_entry": "urban", "town_exit": "rural"}
"""Which kind of road begins behind a sign."""
OPEN_ROAD = "national"
"""The British sign for the national limit: it ends a town, and no motorway."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """One picture's boxes. ``open_picture`` decodes the picture, and is called only if something is to be read."""

    camera: str
    stamp_ns: int
    boxes: Sequence[Box]
    open_picture: Callable[[], Picture | None]
    calibration: Calibration | None = None


@dataclass(frozen=True, slots=True)
class Look:
    """One crop to be read, and for whom."""

    key: Key
    question: str
    image: Picture
    shown: Shown
    closer: Picture | None = None
    """The ring of a zone sign, for a second look."""


class FrontEnd:
    """Keeps the tracks, asks the backend, parses, fuses, weighs, and says facts when they change.

    Beside a backend other than the embedded one, `reader_backend` is the embedded one: it keeps the tracks, and what the
    backend says is weighed against it (`grounding`).
    """

    def __init__(
        self,
        backend: Backend,
        *,
        home: str = "",
        max_reads: int = 8,
        lettering: Lettering | None = None,
        reader_backend: Backend | None = None,
        guarded: bool = True,
    ) -> None:
        self.backend, self.max_reads, self.lettering = backend, max_reads, lettering or Lettering()
        self.reader_backend = reader_backend
        self.guard, self.guarded = grounding.Guard(), guarded
        self.tracks: dict[Key, SignTrack] = {}
        self.backend_tracks: dict[Key, SignTrack] = {}
        """The same tracks by what the backend says of them; without a sign reader beside it, none."""
        self.country_belief = CountryBelief.at_home(home)
        self.here = Here(jurisdiction=self.country_belief.believed)
        self.road_type: tuple[str, float] | None = None
        """The kind of road that the last deciding sign told of, and how sure that sign was."""
        self._ghosts = 0
        self._doubted_lights = DoubtedLights()

    def see(self, sighting: Sighting) -> tuple[Fact, ...]:
        """Read what is worth reading in a picture; facts that are new, changed or due."""
        chosen = self._chosen(sighting)
        self._note_unread(sighting, {box.track_id for box in chosen})
        picture = sighting.open_picture() if chosen else None
        looks = self._looks(sighting, chosen, picture) if picture is not None else []
        for question in dict.fromkeys(look.question for look in looks):
            self._ask([look for look in looks if look.question == question], question, sighting.stamp_ns)
        for look in looks:
            self._note_look(look)
        seen = [
            key
            for key, track in self.tracks.items()
            if key[0] == sighting.camera and track.seen_ns == sighting.stamp_ns
        ]
        for key in seen:
            self._locate(key, sighting)
            if picture is not None:
                self.lettering.look(key, self.tracks[key], picture)
        for look in looks:
            if picture is not None and look.question == QUESTIONS["plate"] and look.key in self.tracks:
                region = look.shown.region
                self.lettering.look_at_plate(look.key, self.tracks[look.key], picture, region, sighting.stamp_ns)
        return tuple(fact for key in seen for fact in self._said(key, sighting.stamp_ns))

    def _note_look(self, look: Look) -> None:
        """Count the pictures in which a sign looks like one of another continent."""
        large = min(look.shown.region.width_px, look.shown.region.height_px) >= sign_look.LEAST_PX
        if large and look.question == QUESTIONS["sign"] and sign_look.is_yellow_diamond(look.image):
            track = self.tracks[look.key]
            self.tracks[look.key] = replace(track, diamonds=track.diamonds + 1)

    def _ask(self, looks: Sequence[Look], question: str, stamp_ns: int) -> None:
        """One question about several crops of one picture; what is read goes to the tracks."""
        for look, readings in zip(looks, self._answers(looks, question), strict=True):
            self._take(look, readings, stamp_ns)
        if self.reader_backend is None:
            self._probe(looks, stamp_ns)
        else:
            self._consult(looks, question, stamp_ns)

    def _answers(self, looks: Sequence[Look], question: str) -> list[Readings]:
        """What the backend that keeps the tracks reads: the sign reader where there is one beside the backend."""
        keeper = self.reader_backend or self.backend
        return self._readings(looks, keeper.answer(_images(looks), question), own=self.reader_backend is None)

    def _consult(self, looks: Sequence[Look], question: str, stamp_ns: int) -> None:
        """Ask the backend beside the sign reader. A backend that takes its time sends the looks off instead."""
        self._hear(looks, self.backend.answer(_images(looks), question), stamp_ns)

    def _hear(self, looks: Sequence[Look], answers: Sequence[Answer], stamp_ns: int) -> None:
        """Take what the backend beside the sign reader says of looks (their pictures in the order of `_images`)."""
        for look, readings in zip(looks, self._readings(looks, answers, own=True), strict=True):
            if look.key in self.tracks:
                self.backend_tracks[look.key] = self._with(look, readings, stamp_ns)
        self._probe(looks, stamp_ns)

    def _readings(self, looks: Sequence[Look], answers: Sequence[Answer], *, own: bool) -> list[Readings]:
        """The readings of looks that ask one question; a zone's number comes from a closer look at its ring.

        `own`: the answers are the backend's own, whose faults count against it.
        """
        closer = [look for look in looks if look.closer is not None]
        every = [*looks, *closer]
        said = [
            answer_checks.checked(answer, look.question, self.here.jurisdiction, look.shown)
            for answer, look in zip(answer_checks.as_many(answers, len(every)), every, strict=True)
        ]
        near = {look.key: each.readings for look, each in zip(closer, said[len(looks) :], strict=True)}
        if own:
            self.guard.probes.asked += len(every)
            for look, each in zip(looks, said, strict=False):
                self.guard.note(look.key, each.fault)
        return [
            plates.sharpened(each.readings, near.get(look.key, ())) for look, each in zip(looks, said, strict=False)
        ]

    def _with(self, look: Look, readings: Readings, stamp_ns: int) -> SignTrack:
        """A track by what the backend says of it, with one more frame's readings."""
        known = self.backend_tracks.get(look.key)
        track = known or replace(self.tracks[look.key], evidence=Evidence(), plate=Evidence())
        if look.question == QUESTIONS["plate"]:
            return track.read_plate(readings, look.shown.region.width_px)
        return track.read(readings, look.shown.region, stamp_ns) if readings else track

    def _probe(self, looks: Sequence[Look], stamp_ns: int) -> None:
        """Probe the backend, if that is due, with a question whose answer is believed now."""
        said = self.tracks if self.reader_backend is None else self.backend_tracks
        sure = {look.key: look for look in looks if look.question != QUESTIONS["plate"] and look.key in said}
        best = {key: said[key].belief() for key in sure}
        settled = [
            Settled(key, look.question, look.image, best[key].reading)
            for key, look in sure.items()
            if said[key].believed(best[key])
        ]
        probe = self.guard.probes.choose(settled, stamp_ns)
        if probe is not None:
            self._try(probe, sure[probe.settled.key])

    def _try(self, probe: Probe, look: Look) -> None:
        """Put a probe's question. A backend that takes its time sends it off and takes the answer by `_tried` later."""
        self._tried(probe, look, self.backend.answer([probe.image], look.question))

    def _tried(self, probe: Probe, look: Look, answers: Sequence[Answer]) -> None:
        """Whether the answer changed with the picture. No answer at all shows nothing against the backend."""
        (answer,) = answer_checks.as_many(answers, 1)
        readings = answer_checks.checked(answer, look.question, self.here.jurisdiction, look.shown).readings
        self.guard.probed(look.key, probe.what, changed=self.guard.probes.answered(probe, readings))

    def settle(self, now_ns: int, speed_mps: float | None) -> tuple[Fact, ...]:
        """Let time pass: tracks out of sight move towards the ego, are passed, or are forgotten.

        While the speed is unknown nothing is passed: what is ahead may be an end, a border, a dark gantry.
        """
        said: list[Fact] = []
        for key, track in list(self.tracks.items()):
            unseen_ns = now_ns - track.seen_ns
            moved = track.moved(now_ns, speed_mps if speed_mps is not None else 0.0)
            self.tracks[key] = moved
            if unseen_ns < UNSEEN_NS:
                continue
            if key[1] > GHOST_IDS:
                said += self._said(key, track.seen_ns)
            if moved.kind != "light" and moved.is_behind(speed_mps):
                said += self._passed(key)
            elif unseen_ns > (_LIGHT_GONE_NS if moved.kind == "light" else GONE_NS):
                self._forget(key)
                if speed_mps is None:
                    self._learn(key, moved, passed=False)
        return tuple(said)

    def _forget(self, key: Key) -> SignTrack:
        self.guard.forget(key)
        self.lettering.forget(key)
        self.backend_tracks.pop(key, None)
        self._doubted_lights.forget(key)
        return self.tracks.pop(key)

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
                self.tracks[key] = self.tracks[key].in_sight(_region(box), sighting.stamp_ns)

    def _looks(self, sighting: Sighting, boxes: Sequence[Box], picture: Picture) -> list[Look]:
        signs, boards = [_region(box) for box in boxes if box.kind == "sign"], has_boards(self.here.jurisdiction)
        looks: list[Look] = []
        for box in boxes:
            if len(looks) >= self.max_reads:
                break
            key, region = (sighting.camera, box.track_id), _region(box)
            self._open(key, box.kind, region, sighting.stamp_ns)
            own, hung = plates.split(region, boards=boards) if box.kind == "sign" else (region, None)
            looks += self._look(key, box.kind, own, picture)
            if hung is None or own.height_px < PLATE_FROM_PX or len(looks) >= self.max_reads:
                continue
            others = [other for other in signs if other != region]
            under = plates.below(own, others)
            looks += self._look(key, "plate", hung if under is None else others[under], picture)
        return looks

    def _look(self, key: Key, kind: str, region: Region, picture: Picture) -> list[Look]:
        """The crop to be asked about; none where too little of it lies in the picture."""
        shown = Shown(region, picture.shape[1], picture.shape[0])
        image = crop(picture, region) if answer_checks.inside(shown) else None
        if image is None:
            return []
        closer = self._closer(key, picture, region) if kind != "plate" else None
        return [Look(key, QUESTIONS[kind], image, shown, closer)]

    def _closer(self, key: Key, picture: Picture, region: Region) -> Picture | None:
        is_zone = self.tracks[key].belief().reading.startswith(plates.HEAD)
        return crop(picture, plates.ring(region)) if is_zone else None

    def _open(self, key: Key, kind: str, region: Region, stamp_ns: int) -> None:
        if key not in self.tracks:
            self.tracks[key] = SignTrack.opened(key, kind, region, stamp_ns)

    def _take(self, look: Look, readings: Readings, stamp_ns: int) -> None:
        track = self.tracks[look.key]
        if look.question == QUESTIONS["plate"]:
            self.tracks[look.key] = track.read_plate(readings, look.shown.region.width_px)
        elif track.contradicted(readings):
            self._take_contrary(look, readings, stamp_ns)
        elif readings:
            self.tracks[look.key] = track.read(readings, look.shown.region, stamp_ns)
        else:
            self.tracks[look.key] = track.in_sight(look.shown.region, stamp_ns)

    def _take_contrary(self, look: Look, readings: Readings, stamp_ns: int) -> None:
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
        if (heard := self.backend_tracks.pop(look.key, None)) is not None:
            self.backend_tracks[ghost] = heard
        self.guard.renamed(look.key, ghost)
        del self.tracks[look.key]
        self._open(look.key, track.kind, look.shown.region, stamp_ns)
        self.tracks[look.key] = self.tracks[look.key].read(readings, look.shown.region, stamp_ns)

    def _locate(self, key: Key, sighting: Sighting) -> None:
        if sighting.calibration is None:
            return
        track = self.tracks[key]
        measured = next(
            (box.range_m for box in sighting.boxes if box.track_id == key[1] and box.range_source == "lidar"), None
        )
        seen = sign_position.place(track.region, track.shape, sighting.calibration, measured)
        place = sign_position.smoothed(track.place, track.travelled_m, seen)
        self.tracks[key] = replace(track, place=place, travelled_m=0.0)

    def _learn(self, key: Key, track: SignTrack, *, passed: bool = True) -> None:
        """Count a believed sign as a cue of the country, once it is passed: what is ahead may stand beyond a border.

        A sign that was lost from sight at an unknown speed can only put a country in doubt.
        """
        best = track.belief()
        believed = track.believed(best)
        if believed and best.reading.startswith("border:"):
            if passed:
                self.believe(self.country_belief.past_border(key, best.reading.partition(":")[2]))
            return
        plates_read = [(f"{key[0]}/plate", plate) for plate in track.plates()]
        told = [(key[0], best.reading), *plates_read] if believed else []
        if track.diamonds >= sign_look.FRAMES:
            told.append((f"{key[0]}/look", sign_look.CODE))
        where = self.country_belief
        for camera, code in told:
            where = where.with_cue((camera, key[1]), cues_of(code), code, passed=passed)
        self.believe(where)

    def believe(self, where: CountryBelief) -> None:
        """Take over a belief about the country."""
        self.country_belief = where
        self.here = self.here._replace(jurisdiction=where.believed)

    def _facts(self, key: Key, *, passed: bool = False) -> tuple[Fact, ...]:
        """What is to be said of a track, weighed by its grounds, with what was read of its letters."""
        return tuple(self.lettering.on(key, fact) for fact in self._grounded(key, passed=passed))

    def _grounded(self, key: Key, *, passed: bool) -> tuple[Fact, ...]:
        track = self.tracks[key]
        read = fact_of(track, self.here, passed=passed)
        if self.reader_backend is None:
            own = self.guard.own(key, read) if self.guarded else read
            return () if own is None else (own,)
        heard, best = self.backend_tracks.get(key, track), track.belief()
        mine = None
        if key in self.backend_tracks:
            said = replace(track, evidence=heard.evidence, plate=heard.plate, seen_ns=heard.seen_ns)
            mine = fact_of(said, self.here, passed=passed)
            mine = self.guard.own(key, mine) if self.guarded else mine
        if not self.guarded:
            unguarded = mine or read
            return () if unguarded is None else (unguarded,)
        nothing = best.reading == OTHER and best.probability >= NOTHING_THERE and track.evidence.frames > 1
        return grounding.weighed(mine, read, self.here.road_class, nothing_there=nothing)

    def _said(self, key: Key, stamp_ns: int) -> tuple[Fact, ...]:
        track, facts = self.tracks[key], self._facts(key)
        if track.kind == "light":
            facts = self._doubted_lights.after(key, track, facts)
        content = tuple(
            (each.reading, each.believed, each.scope, each.plates, each.unit, each.text, each.grounding)
            for each in facts
        )
        due = stamp_ns - track.said_ns >= REPEAT_NS or track.kind == "light"
        if not facts or (content == track.said and not due):
            return ()
        self.tracks[key] = replace(track, said=content, said_ns=stamp_ns)
        return facts

    def _passed(self, key: Key) -> tuple[Fact, ...]:
        facts = self._facts(key, passed=True)
        track = self._forget(key)
        if track.grew and not any(fact.grounding for fact in facts):
            self._learn(key, track)
        for fact in facts:
            if fact.believed and fact.reading in ROAD_TYPES:
                self.road_type = (ROAD_TYPES[fact.reading], fact.confidence)
            elif (
                fact.believed and fact.reading == OPEN_ROAD and (self.road_type is None or self.road_type[0] == "urban")
            ):
                self.road_type = ("rural", fact.confidence)
        return facts


def _images(looks: Sequence[Look]) -> list[Picture]:
    """The pictures of looks that ask one question: each look's, then the closer ones of those that have one."""
    return [look.image for look in looks] + [look.closer for look in looks if look.closer is not None]


def _region(box: Box) -> Region:
    return Region(box.x0_px, box.y0_px, box.x1_px, box.y1_px)
