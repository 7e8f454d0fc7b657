"""When a limit is assumed: Rules and orchestrator each know a part of what tells the place."""

import msgspec

from proto.rules import RulesAnswer

OF_THE_ROAD = ("default", "advisory")
"""Bases of a limit that a sign does not set."""


def assuming(answer: RulesAnswer, *, posted: bool) -> RulesAnswer:
    """The answer with its limit marked as assumed, unless one of the signs in force (`posted`) sets that limit."""
    if answer.limit is None or (posted and answer.basis not in OF_THE_ROAD):
        return answer
    return msgspec.structs.replace(answer, limit=msgspec.structs.replace(answer.limit, assumed=True))
