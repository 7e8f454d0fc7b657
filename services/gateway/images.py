"""Pictures beside results: the frame that a scene's answer or a decision rests on, its boxes drawn by the front end."""

import base64
import binascii
from collections.abc import Callable, Mapping
from typing import Any

from mcp import types

from drivemcp.node import Node
from proto.tools import Outcome

MOST_BYTES = 200_000
PICTURE_MS = 1500.0
Which = Mapping[str, int]
PICTURED: Mapping[str, Callable[[Any], Which]] = {
    "describe_scene": lambda result: {"frame": result["graph"]["frame"]},
    "ask_scene": lambda result: {"frame": result["frame"]},
    "explain_decision": lambda result: {"tick": result["tick"]},
}
"""By tool: which picture belongs to its result."""


def picture_of(node: Node, outcome: Outcome) -> list[types.ContentBlock]:
    """The picture, or nothing: where the tool has none, or it is no longer kept. Blocks."""
    which = PICTURED.get(outcome.tool)
    if which is None or not outcome.ok:
        return []
    try:
        asked = which(outcome.result)
    except (KeyError, TypeError):
        return []
    return _image(node.call("decided_picture", asked, deadline_ms=PICTURE_MS))


def _image(outcome: Outcome) -> list[types.ContentBlock]:
    data = (outcome.result or {}).get("jpeg_base64")
    if not isinstance(data, str) or len(data) > MOST_BYTES * 4 // 3 + 4:
        return []
    try:
        jpeg = base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError):
        return []
    if not jpeg.startswith(b"\xff\xd8") or len(jpeg) > MOST_BYTES:
        return []
    return [types.ImageContent(data=data, mime_type="image/jpeg")]
