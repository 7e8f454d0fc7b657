"""The call that every subject makes: about 1.5 kB of JSON there and back. Standard library only: peers import it, too."""

from typing import Any

ARGUMENTS: dict[str, Any] = {
    "situation": {
        "jurisdiction": "DEU", "road_type": "rural", "vehicle_class": "car", "wet": True, "visibility_m": 180.0,
        "segment_id": "s-0042", "language": "en",
        "posted": [
            {"value": 80.0 + i, "unit": "km/h", "scope": "permanent", "confidence": 0.97, "reading": f"limit:{80 + i}"}
            for i in range(5)
        ],
    }
}  # fmt: skip
RESULT: dict[str, Any] = {
    "legal_action": "comply_with_limit", "limit_value": 80.0, "limit_mps": 22.222, "confidence": 0.93,
    "rulepack_version": "DEU-v1@1.0.0#0123456789ab", "basis": "conditional",
    "citations": [
        {"document": "limits.md", "start": 1200 + i, "end": 1420 + i, "section": "s. 3", "excerpt": "speed must suit road and sight " * 4}
        for i in range(4)
    ],
}  # fmt: skip
TOOL = "applicable_limit"
SLOW_MS = 20.0
