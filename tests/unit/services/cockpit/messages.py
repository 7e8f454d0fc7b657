"""What the orchestrator would publish, for tests of the cockpit."""

from typing import Any

import msgspec

from domain.units import legal_limit
from proto.decision import Advisory
from proto.scene import Unit
from proto.speed_assistance import SpeedAssistance

SILENT = Advisory(
    tick=1, snapshot_stamp_ns=1, kind="SILENT", directive="", justification="", urgency="info", topic="", hazard="",
    target_mps=None, legal_limit=None, unit="km/h", language="en", confidence=1.0,
)  # fmt: skip


def told(words: str, urgency: str = "advice", **fields: Any) -> Advisory:
    """An advisory that is spoken."""
    given = {"kind": "SPEAK", "directive": words, "urgency": urgency, "justification": "The sign says so.", **fields}
    return msgspec.structs.replace(SILENT, **given)


def assistance(value: float | None, unit: Unit = "km/h", *, assumed: bool = False, **fields: Any) -> SpeedAssistance:
    """The state beside a limit."""
    limit = None if value is None else msgspec.structs.replace(legal_limit(value, unit), assumed=assumed)
    given = {"tick": 1, "snapshot_stamp_ns": 1, "speed_mps": 13.0, "country": "DEU", "limit": limit, **fields}
    return SpeedAssistance(**given)
