"""What is known of one sign, panel or light over the frames in which it was seen."""

from dataclasses import dataclass, field, replace

import msgspec

from proto.scene import Fact
from services.drivelm.reading.crops import Region
from services.drivelm.reading.evidence import Belief, Evidence, belief, fused
from services.drivelm.reading.sign_position import SignPosition
from services.drivelm.vocabulary.classes import OTHER

BELIEVE = 0.98
"""Posterior from which a reading is believed; measured in ``models/reader.json`` (`tracks`)."""
CLEAR_FRAMES = 2.0
"""Clear frames (see ``evidence.CLEAR``) that belief needs besides."""
PLATE_BELIEVE = 0.95
DOUBT = 0.30
"""Posterior from which a reading that is not believed is worth reporting as a candidate."""
DOUBT_PX = 16.0
CONTRARY = 0.9
CONTRARY_FRAMES = 2
"""How clearly, and in how many frames in a row, a track must show something else to be taken for another thing."""
KEEP = {"sign": 1.0, "panel": 0.85, "light": 0.62}
"""Share of old evidence that survives each frame; lights change at once, panels within seconds, signs never."""
UNREAD_NS = 1_000_000_000
"""A light counts as it was read for so long. In 39,558 rendered pictures of twelve drives none went unread for more than 0.7 s
(boxes of fewer than 9 px), and none had more lights than are read."""
GROWN = 1.25
"""How much larger than at first a thing is seen before it is passed. Of 60 signs passed in modelled drives none grew less than 1.6
times; what a picture merely holds for a moment (a truck's board, a shadow) need not grow at all."""
_LIGHT_CLEAR = 1.6  # with a share forgotten each frame, two clear frames in a row give 1.62
_LIGHT_BELIEVE = 0.97  # with that share forgotten, small crops add up to no more, however clear


@dataclass(frozen=True, slots=True, kw_only=True)
class SignTrack:
    """One tracked traffic element; values are replaced, never changed."""

    camera: str
    track_id: int
    kind: str
    first_ns: int
    seen_ns: int
    region: Region
    first_px: float
    largest_px: float
    """Height in the picture at first, and at most so far."""
    read_ns: int = 0
    """When it was last read, not only seen."""
    evidence: Evidence = field(default_factory=Evidence)
    plate: Evidence = field(default_factory=Evidence)
    place: SignPosition | None = None
    travelled_m: float = 0.0
    """How far the ego went since the element was last seen."""
    moved_ns: int = 0
    contrary: int = 0
    """Frames in a row that clearly showed something else: perception's track has jumped to another thing."""
    diamonds: int = 0
    """Pictures in which it looked like a yellow diamond, whatever it was read as."""
    said: tuple[object, ...] = ()
    said_ns: int = 0

    @classmethod
    def opened(cls, key: "Key", kind: str, region: Region, stamp_ns: int) -> "SignTrack":
        """An element seen for the first time, and not read yet."""
        px = region.height_px
        return cls(
            camera=key[0], track_id=key[1], kind=kind, first_ns=stamp_ns, seen_ns=stamp_ns,
            region=region, first_px=px, largest_px=px,
        )  # fmt: skip

    def belief(self) -> Belief:
        """The best reading so far."""
        return belief(self.evidence)

    def believed(self, best: Belief) -> bool:
        """Whether the evidence suffices."""
        sure, clear = (_LIGHT_BELIEVE, _LIGHT_CLEAR) if self.kind == "light" else (BELIEVE, CLEAR_FRAMES)
        return best.reading != OTHER and best.probability >= sure and best.clear_frames >= clear

    def doubted(self, best: Belief) -> bool:
        """Whether there is probably something, yet not surely what."""
        readable = self.region.height_px >= DOUBT_PX and self.evidence.frames >= 2
        return readable and not is_nothing(best) and best.probability >= DOUBT

    def plates(self) -> tuple[str, ...]:
        """The believed plate below, if any."""
        best = belief(self.plate)
        sure = best.reading != OTHER and best.probability >= PLATE_BELIEVE and best.clear_frames >= CLEAR_FRAMES
        return (best.reading,) if sure else ()

    @property
    def settled(self) -> bool:
        """Nothing more to learn: a sign, which does not change, read with 0.999 or more, its plate question answered too."""
        best, plate = self.belief(), belief(self.plate)
        plate_known = self.plate.frames >= 4 and plate.probability >= PLATE_BELIEVE
        return self.kind == "sign" and best.probability >= 0.999 and best.clear_frames >= 5 and plate_known

    @property
    def grew(self) -> bool:
        """Whether it grew in the picture as what stands at the road does that the ego comes up to."""
        return self.largest_px >= GROWN * self.first_px

    def contradicted(self, ranked: tuple[tuple[str, float], ...]) -> bool:
        """Whether a frame clearly shows another kind of thing than the one believed: not another number on the same
        kind of sign (that is doubt, and is weighed), but another sign, or nothing."""
        best = self.belief()
        top, share = max(ranked, key=lambda row: row[1], default=(OTHER, 0.0))
        different = top.partition(":")[0] != best.reading.partition(":")[0]
        return self.kind == "sign" and self.believed(best) and different and share >= CONTRARY

    def read(self, ranked: tuple[tuple[str, float], ...], region: Region, stamp_ns: int) -> "SignTrack":
        """With one more frame's readings."""
        keep = KEEP[self.kind]
        evidence = fused(self.evidence, ranked, _legible_px(self.kind, region), keep)
        return replace(self._at(region, stamp_ns), evidence=evidence, read_ns=stamp_ns, contrary=0)

    def read_plate(self, ranked: tuple[tuple[str, float], ...], height_px: float) -> "SignTrack":
        """With one more frame's readings of the plate below; a plate is half as high as it is wide, so count its width."""
        return replace(self, plate=fused(self.plate, ranked, height_px))

    def in_sight(self, region: Region, stamp_ns: int) -> "SignTrack":
        """Seen, and not read this time. A light that was not read for a while may have changed since: it is as good as unseen."""
        if self.kind == "light" and stamp_ns - max(self.first_ns, self.read_ns) > UNREAD_NS:
            return self
        return self._at(region, stamp_ns)

    def _at(self, region: Region, stamp_ns: int) -> "SignTrack":
        return replace(self, region=region, largest_px=max(self.largest_px, region.height_px), seen_ns=stamp_ns)

    @property
    def shape(self) -> str:
        """Something of the size that the element has, as far as it is known."""
        return {"light": "light:off", "panel": "led:blank"}.get(self.kind, self.belief().reading)

    def is_behind(self, speed_mps: float | None) -> bool:
        """Whether the ego has driven past. Without a speed this is not known, and the element counts as ahead."""
        return speed_mps is not None and self.place is not None and self.travelled_m >= self.place.distance_m

    def moved(self, stamp_ns: int, speed_mps: float) -> "SignTrack":
        """With the way the ego went since."""
        since_ns = max(self.moved_ns, self.seen_ns)
        step_m = max(0.0, speed_mps) * max(0, stamp_ns - since_ns) * 1e-9
        return replace(self, travelled_m=self.travelled_m + step_m, moved_ns=stamp_ns)


def is_nothing(best: Belief) -> bool:
    """Whether there is more probably nothing to be read than something."""
    return sum(share for reading, share in best.ranked if reading != OTHER) < 0.5


def _legible_px(kind: str, region: Region) -> float:
    """The size that decides how legible a crop is: the shorter side; a light is narrow, its three lamps lie along it."""
    return 0.8 * region.height_px if kind == "light" else min(region.height_px, region.width_px)


Key = tuple[str, int]
"""Camera and number of a track."""


class DoubtedLights:
    """The last statement on each light in sight. A light that was believed once is never withdrawn, nor is a light out of sight."""

    def __init__(self) -> None:
        self._last: dict[Key, Fact] = {}
        self._believed: set[Key] = set()

    def after(self, key: Key, track: SignTrack, facts: tuple[Fact, ...]) -> tuple[Fact, ...]:
        """What is to be said of a light after one more picture: its facts, or, once, that it is withdrawn."""
        if facts:
            self._last[key] = facts[0]
            if any(fact.believed for fact in facts):
                self._believed.add(key)
            return facts
        if key in self._believed or key not in self._last or not is_nothing(track.belief()):
            return ()
        doubted = self._last.pop(key)
        return (msgspec.structs.replace(doubted, frame_stamp_ns=track.seen_ns, confidence=0.0, withdrawn=True),)

    def forget(self, key: Key) -> None:
        """The light is out of the pictures: what was told of it stands."""
        self._last.pop(key, None)
        self._believed.discard(key)
