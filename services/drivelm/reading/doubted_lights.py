"""Lights that were told with doubt, and are taken back once later pictures show that there is none.

A red light stands until it is passed, out of sight too. Without a word a dark window that was taken for a lamp in two
pictures would so stop a car seconds later.
"""

import msgspec

from proto.scene import Fact
from services.drivelm.reading.sign_tracks import SignTrack, is_nothing

Key = tuple[str, int]
"""Camera and number of a track."""


class DoubtedLights:
    """What was last said of each light in sight. One that was ever believed is never taken back, nor one out of sight."""

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
