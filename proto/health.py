"""What a service says of itself, and what the logger says of its chain."""

import msgspec


class TopicHealth(msgspec.Struct, frozen=True, kw_only=True):
    """Three bits per topic, computed once in the runtime."""

    topic: str
    alive: bool
    on_rate: bool
    valid: bool
    received: int = 0
    lost: int = 0
    malformed: int = 0
    age_ms: float | None = None


class ServiceHealth(msgspec.Struct, frozen=True, kw_only=True):
    """Published by every service once a second."""

    service: str
    pid: int
    uptime_s: float
    rss_mb: float
    topics: tuple[TopicHealth, ...] = ()
    calls_served: int = 0
    calls_refused: int = 0
    dropped: int = 0
    detail: dict[str, str] = {}
    """What the service wants known: encoder and detector in use, rulepack versions."""


class ChainHead(msgspec.Struct, frozen=True, kw_only=True):
    """The running head of the log's hash chain."""

    file: str
    records: int
    head_sha256: str
    signature: str = ""
    key_id: str = ""
    closed: bool = False


class ServiceLog(msgspec.Struct, frozen=True, kw_only=True):
    """One structured log line."""

    service: str
    level: str
    message: str
    fields: dict[str, str] = {}
