"""Which passages may answer at all, as a value: a function in memory, part of the query in an engine."""

import msgspec

from services.retrieval.corpus import Corpus, Text


class Filter(msgspec.Struct, frozen=True, kw_only=True):
    """What a passage must be; the country is chosen before."""

    corpus: Corpus | None = None
    tongues: frozenset[str] = frozenset()
    """`<corpus>/<language>`; empty: any."""
    road_type: str | None = None
    """None: not known."""
    on: str = ""
    """ISO date; empty: not known."""

    def __call__(self, text: Text) -> bool:
        """Whether the passage may answer."""
        fits = self.corpus in (None, text.corpus) and (not self.tongues or text.tongue in self.tongues)
        return fits and text.holds(self.road_type, self.on)
