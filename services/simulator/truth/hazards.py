"""Hazards of the ego: their sources, and those that are on, from onset until they are over."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from services.simulator.scene.scene import Box


@dataclass(frozen=True, slots=True, kw_only=True)
class HazardSource:
    """Something that is or may become a hazard now; `key` tells it from all others of the drive."""

    kind: str
    key: int
    distance_m: float
    """From the ego's front; behind it negative."""
    begins: bool
    """The truth has crossed the event's threshold."""
    body: Box | None = None
    """What has to be in sight; None: nothing to see, one feels it."""
    actor_id: int | None = None
    lit: bool = False
    """Carries light of its own, or is lit by the road's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hazard:
    """A hazard that is on."""

    kind: str
    onset_s: float
    actor_id: int | None
    distance_m: float


@dataclass(slots=True)
class HazardLog:
    """Hazards from their onset until they are over; none comes twice."""

    _since: dict[tuple[str, int], float] = field(default_factory=dict)
    _over: set[tuple[str, int]] = field(default_factory=set)

    def note(
        self, sources: Iterable[HazardSource], in_sight: Callable[[HazardSource], bool], time_s: float
    ) -> tuple[Hazard, ...]:
        """The hazards that are on, oldest first. One begins when its threshold is crossed and it is in sight."""
        now = {(source.kind, source.key): source for source in sources}
        self._over |= self._since.keys() - now.keys()
        for key, source in now.items():
            if key not in self._since and source.begins and in_sight(source):
                self._since[key] = time_s
        on = [(self._since[key], source) for key, source in now.items() if key in self._since and key not in self._over]
        on.sort(key=lambda item: (item[0], item[1].kind, item[1].key))
        return tuple(
            Hazard(kind=each.kind, onset_s=since, actor_id=each.actor_id, distance_m=each.distance_m)
            for since, each in on
        )
