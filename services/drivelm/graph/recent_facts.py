"""What was last said of each thing in sight, for the graph."""

from collections.abc import Sequence

from proto.scene import Fact

RECENT_NS = 2_000_000_000


class RecentFacts:
    """The last fact of each track, by its camera and number; what is withdrawn or older is none."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, int], tuple[int, Fact]] = {}

    def take_in(self, facts: Sequence[Fact], stamp_ns: int) -> None:
        """Facts said at a time."""
        for fact in facts:
            self._last[fact.camera, fact.track_id] = (stamp_ns, fact)

    def at(self, now_ns: int) -> tuple[Fact, ...]:
        """Those that still hold."""
        self._last = {key: row for key, row in self._last.items() if now_ns - row[0] < RECENT_NS}
        return tuple(fact for _, fact in self._last.values() if not fact.withdrawn)
