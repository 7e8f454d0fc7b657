"""Which of several candidates is said: one pure function, by the table of kinds and the memory of what was said."""

from domain.speech import is_told
from proto.messages import Kind
from proto.speech import Memory
from services.orchestrator.speech.candidate import Candidate

LEAST_PAUSE_S = 1.0
"""Between two messages on one topic, hazards apart."""
EPISODE_PAUSE_S = 10.0
"""A degradation that comes and goes within this time is one episode; a fault that was never told is another at once."""


def choose(found: tuple[Candidate, ...], memory: Memory, now_ns: int) -> Candidate | None:
    """The first, in the table's order, of: new hazards that the driver was not warned of lately, first notices that are owed, new
    hazards, standing hazards, news, all.

    A warning counts for its hazard, not for a track: the arbiter repeats it in its time, and meanwhile a first notice comes first.
    """

    def rank(each: Candidate) -> int:
        new, hazard = is_new(each, memory, now_ns), bool(each.hazard)
        told = is_told(memory, each.hazard, now_ns, alarm=each.urgency == "alarm")
        ranks = (
            hazard and new and not told,
            owes_first_notice(each, memory, now_ns),
            hazard and new,
            hazard,
            new,
            True,
        )
        return ranks.index(True)

    return min(found, key=rank, default=None)


def is_new(candidate: Candidate, memory: Memory, now_ns: int) -> bool:
    """Whether the kind says something else than last time, or it was said long ago."""
    told = memory.last(candidate.remembered_as, candidate.about)
    if told is None or (now_ns - told.stamp_ns) / 1e9 >= candidate.repeat_s:
        return True
    # A calmer word on a hazard just told is no news.
    paused = (now_ns - told.stamp_ns) / 1e9 >= LEAST_PAUSE_S
    return told.news != candidate.news and (candidate.hazard != "" or paused)


def owes_first_notice(candidate: Candidate, memory: Memory, now_ns: int) -> bool:
    """Whether this episode of an overspeed or a degradation has not been told yet; of one limit once in a while, of another anew,
    and of a lower one though the driver was too fast for the one before, too."""
    if candidate.first_since_ns is None or not candidate.row.first_notice:
        return False
    told, news = memory.last(candidate.remembered_as, candidate.about), candidate.news
    if told is None:
        return True
    if candidate.kind is Kind.OVERSPEED:
        return told.stamp_ns < candidate.first_since_ns  # the table of times says when it is sounded again
    pause_s = LEAST_PAUSE_S if set(candidate.names) - set(memory.noticed) else EPISODE_PAUSE_S
    return told.news != news and now_ns - told.stamp_ns >= pause_s * 1e9
