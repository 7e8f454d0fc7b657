"""Key expressions. Nothing that a caller typed becomes part of one before it is checked here."""

import re
from functools import lru_cache

from proto.topics import Topic

_CHUNK = re.compile(r"[A-Za-z0-9_.-]{1,64}")


@lru_cache(maxsize=1024)
def chunk(text: str) -> str:
    """`text` if it can stand as one chunk of a key expression; ValueError on wildcards, slashes, excess length."""
    if not is_chunk(text):
        raise ValueError(f"{text[:80]!r} is not a name: 1 to 64 of letters, digits, '_', '.', '-'")
    return text


def is_chunk(text: str) -> bool:
    """Whether it can stand as one chunk of a key expression."""
    return _CHUNK.fullmatch(text) is not None


def topic_key(vehicle: str, topic: Topic, id: str | None = None) -> str:  # type: ignore[type-arg]
    """`drivemcp/<vehicle>/<topic>`; without an id, a topic that has one becomes a wildcard for subscribing."""
    if id is not None and not topic.has_id:
        raise ValueError(f"topic {topic.name!r} has no id")
    name = topic.name.replace("<id>", chunk(id) if id is not None else "*")
    return f"drivemcp/{chunk(vehicle)}/{name}"


def tool_key(vehicle: str, server: str, tool: str) -> str:
    """The queryable of one tool."""
    return f"drivemcp/{chunk(vehicle)}/tool/{chunk(server)}/{chunk(tool)}"


def catalogue_key(vehicle: str, server: str | None = None) -> str:
    """The catalogue queryable of a server; of every server without a name."""
    return f"drivemcp/{chunk(vehicle)}/tool/{chunk(server) if server is not None else '*'}"


def alive_key(vehicle: str, service: str | None = None) -> str:
    """The liveliness token of a service; of every service without a name."""
    return f"drivemcp/{chunk(vehicle)}/alive/{chunk(service) if service is not None else '*'}"


def step_key(vehicle: str, service: str) -> str:
    """The queryable by which the lockstep conductor steps a service."""
    return f"drivemcp/{chunk(vehicle)}/step/{chunk(service)}"
