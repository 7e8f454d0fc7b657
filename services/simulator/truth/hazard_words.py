"""Which messages name a true hazard."""

from collections.abc import Mapping

from proto.decision import Advisory
from proto.messages import ROWS, Kind

OF_A_LEAD = frozenset({*ROWS[Kind.LEAD].hazards, Kind.LEAD})
_OF_A_PERSON = frozenset({*ROWS[Kind.PERSON].hazards, Kind.PERSON})
WORDS: Mapping[str, frozenset[str]] = {
    "pedestrian": _OF_A_PERSON,
    "lead_brakes": OF_A_LEAD,
    "stopped_lead": OF_A_LEAD,
    "congestion_tail": OF_A_LEAD,
    "cut_in": OF_A_LEAD,
    "stop_line": frozenset({*ROWS[Kind.STOP].hazards, Kind.STOP}),
    "priority": frozenset({"priority", "give_way", "right_of_way", "yield"}) | OF_A_LEAD,
    "school_zone": frozenset({"limit", "ahead", "overspeed", "school", "children"}),
    "deep_water": frozenset({"friction", "deep_water", "low_friction"}),
}
"""A true hazard's kind, and the hazards or topics of messages that name it. Another kind is named by its own name alone."""


def names(advisory: Advisory, kind: str) -> bool:
    """Whether a message is about a hazard of that kind."""
    return bool({advisory.hazard, advisory.topic} & WORDS.get(kind, frozenset({kind})))
