"""The bus: a Zenoh session with explicit endpoints. This is the one module that knows Zenoh."""

import json
import os
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

import zenoh
from zenoh import handlers

from drivemcp.bus.tls import tls_settings, why_refused
from drivemcp.config import BusConfig
from drivemcp.errors import BusError

SHARED_FROM_BYTES = 65536
"""Between processes of one machine larger messages (pictures, point clouds) go through shared memory. The first one makes a
session keep 16 MB for it; a session that sends no message this large is spared that."""
LEAST_SHARED_BYTES = 32 << 20
MOST_BYTES = 32 << 20
"""No message is larger; a larger one is dropped before it is copied, and its transport does not keep its parts."""
MOST_QUERY_BYTES = 4 << 20
"""Arguments of more count as none at all."""
MOST_HEAD_BYTES = 64 << 10
QUEUED = 16
"""Batches that wait for a link, the most that Zenoh takes. Pictures, sweep and readings of one instant leave together; Zenoh's own 2 are
full with the third of them, and what may be dropped was dropped where the link was not busy but only woken 1 ms late."""
OnSample = Callable[[str, bytes, bytes], None]
OnLife = Callable[[str, bool], None]


class Query:
    """A query that waits for its reply. Always `answer`, `refuse` or `drop` it, or the caller waits out its timeout."""

    __slots__ = ("_query", "attachment", "payload")

    def __init__(self, query: zenoh.Query) -> None:
        self._query = query
        payload, attachment = query.payload, query.attachment
        self.payload = b"" if payload is None or len(payload) > MOST_QUERY_BYTES else payload.to_bytes()
        self.attachment = b"" if attachment is None else attachment.to_bytes()

    @property
    def key(self) -> str:
        """The key that was asked."""
        return str(self._query.key_expr)

    def answer(self, key: str, payload: bytes) -> None:
        """Reply with data."""
        with self._query:
            self._query.reply(key, payload)

    def refuse(self, payload: bytes) -> None:
        """Reply with an error."""
        with self._query:
            self._query.reply_err(payload)

    def drop(self) -> None:
        """Give no reply."""
        self._query.drop()  # type: ignore[no-untyped-call]


class Reply:
    """What one query brought: data, an error, or (neither) the end of replies."""

    __slots__ = ("error", "key", "payload")

    def __init__(self, payload: bytes | None, error: bytes | None, key: str = "") -> None:
        self.payload = payload
        self.error = error
        self.key = key
        """Under which the data came; access control lets a server answer under its own keys alone."""


OnReply = Callable[[Reply | None], None]
"""Called with every reply, then once with None when no more will come. On a Zenoh thread: hand over at once."""


class Publisher:
    """Puts bytes under one key."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Send."""
        self._publisher.put(payload, attachment=attachment)

    def matching(self) -> bool:
        """Whether anyone subscribes."""
        return bool(getattr(self._publisher.matching_status, "matching", False))


class Querier:
    """Asks one key again and again."""

    def __init__(self, querier: zenoh.Querier) -> None:
        self._querier = querier

    def get(self, payload: bytes, attachment: bytes, on_reply: OnReply) -> None:
        """Ask; replies come to `on_reply`. Where no service is known to serve the key, `None` follows after the last reply.

        Where a service is known to serve it, nothing tells that no more replies will come: a wake-up saved at each call.
        """
        served = bool(getattr(self._querier.matching_status, "matching", False))
        end = () if served else (lambda: on_reply(None),)
        self._querier.get(
            handlers.Callback(_to_reply(on_reply), *end, indirect=False), payload=payload, attachment=attachment
        )


class Bus:
    """One session. Several nodes of one process may share it; callbacks run on Zenoh's threads and only hand over."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._kept: list[object] = []
        self._closed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def publisher(self, key: str, *, droppable: bool = False) -> Publisher:
        """Declare a publisher. Under congestion it waits, unless what it carries may be dropped."""
        control = zenoh.CongestionControl.DROP if droppable else zenoh.CongestionControl.BLOCK
        publisher = self._session.declare_publisher(key, congestion_control=control, express=True)
        self._keep(publisher)
        return Publisher(publisher)

    def subscribe(self, key: str, on_sample: OnSample) -> None:
        """Deliver (key, payload, attachment)."""

        def deliver(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            if len(sample.payload) > MOST_BYTES or (attachment is not None and len(attachment) > MOST_HEAD_BYTES):
                return
            on_sample(
                str(sample.key_expr), sample.payload.to_bytes(), b"" if attachment is None else attachment.to_bytes()
            )

        self._keep(self._session.declare_subscriber(key, handlers.Callback(deliver, indirect=False)))

    def serve(self, key: str, on_query: Callable[[Query], None]) -> None:
        """Answer queries on a key."""

        def deliver(query: zenoh.Query) -> None:
            on_query(Query(query))

        self._keep(self._session.declare_queryable(key, handlers.Callback(deliver, indirect=False), complete=True))

    def querier(self, key: str, timeout_s: float) -> Querier:
        """Declare a querier of one key, to be asked again and again."""
        querier = self._session.declare_querier(
            key, timeout=timeout_s, consolidation=zenoh.ConsolidationMode.NONE, express=True
        )
        self._keep(querier)
        return Querier(querier)

    def get(
        self, key: str, on_reply: OnReply, *, timeout_s: float, payload: bytes = b"", attachment: bytes = b""
    ) -> None:
        """Ask every server whose key matches."""
        self._session.get(
            key,
            handlers.Callback(_to_reply(on_reply), lambda: on_reply(None), indirect=False),
            payload=payload,
            attachment=attachment,
            timeout=timeout_s,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def announce(self, key: str) -> None:
        """Hold a liveliness token until the session closes or dies."""
        self._keep(self._session.liveliness().declare_token(key))

    def watch(self, key: str, on_life: OnLife) -> None:
        """Deliver (key, alive) for every liveliness token, those already there first."""

        def deliver(sample: zenoh.Sample) -> None:
            on_life(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        self._keep(
            self._session.liveliness().declare_subscriber(key, handlers.Callback(deliver, indirect=False), history=True)
        )

    def close(self) -> None:
        """Close the session. Never call it from a callback."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._session.close()  # type: ignore[no-untyped-call]

    def _keep(self, entity: object) -> None:
        with self._lock:
            self._kept.append(entity)


def _to_reply(on_reply: OnReply) -> Callable[[zenoh.Reply], None]:
    def deliver(reply: zenoh.Reply) -> None:
        sample = reply.ok
        if sample is not None:
            on_reply(Reply(sample.payload.to_bytes(), None, str(sample.key_expr)))
        elif (error := reply.err) is not None:
            on_reply(Reply(None, error.payload.to_bytes()))

    return deliver


def zenoh_config(config: BusConfig, *, mode: str | None = None, extra: dict[str, object] | None = None) -> zenoh.Config:
    """Our settings as Zenoh's: explicit endpoints, no multicast unless asked, a lease of one second."""
    settings: dict[str, object] = {
        "mode": mode or config.mode,
        "connect/endpoints": list(config.connect),
        "listen/endpoints": list(config.listen),
        "connect/timeout_ms": int(config.connect_timeout_s * 1000),
        "connect/exit_on_failure": True,
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 1.5},
        "scouting/multicast/enabled": config.multicast,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": 1000,
        "transport/link/tx/queue/size/data": QUEUED,
        "transport/link/rx/max_message_size": MOST_BYTES + MOST_HEAD_BYTES + 4096,
        "timestamping/enabled": False,
        "transport/shared_memory/enabled": shares_memory(),
        "transport/shared_memory/transport_optimization/message_size_threshold": SHARED_FROM_BYTES,
    }
    if config.user:
        password = Path(config.password_file).read_text(encoding="utf-8-sig").strip()
        settings["transport/auth/usrpwd/user"] = config.user
        settings["transport/auth/usrpwd/password"] = password
    settings.update(tls_settings(config))
    settings.update(extra or {})
    result = zenoh.Config()
    for name, value in settings.items():
        result.insert_json5(name, json.dumps(value))
    return result


def shares_memory(folder: str = "/dev/shm") -> bool:
    """Whether there is room for shared memory. Without room, large messages take the socket as all others do."""
    try:
        room = os.statvfs(folder)
    except OSError:
        return not sys.platform.startswith("linux")
    return os.access(folder, os.W_OK) and room.f_bavail * room.f_frsize >= LEAST_SHARED_BYTES


_SOURCE_PLACE = re.compile(r" at /\S+\.rs:\d+\.?")


def open_bus(
    config: BusConfig, *, mode: str | None = None, extra: dict[str, object] | None = None, log: str = "error"
) -> Bus:
    """Open a session. Raises BusError with what to do when nothing answers at the endpoints or a port is taken.

    `log`: from which level on Zenoh writes to stderr where RUST_LOG says nothing; `off` for a person's terminal.
    """
    zenoh.init_log_from_env_or(log)
    try:
        return Bus(zenoh.open(zenoh_config(config, mode=mode, extra=extra)))
    except zenoh.ZError as error:
        where = ", ".join((*config.connect, *config.listen)) or "in-process"
        why = _SOURCE_PLACE.sub("", str(error))[:160]
        hint = "" if config.user or not config.connect else ", does it want a user and a password"
        if refused := why_refused(config):
            raise BusError(f"no bus at {where}: {refused}") from None
        raise BusError(f"no bus at {where}: is the router running, is the port free{hint}? ({why})") from None
    except OSError as error:
        raise BusError(f"cannot read the bus password {config.password_file}: {error.strerror}") from None


def wait_settled(check: Callable[[], bool], timeout_s: float) -> bool:
    """Poll a matching or liveliness condition until it holds; False after `timeout_s`."""
    pause = threading.Event()
    for _ in range(max(1, int(timeout_s / 0.005))):
        if check():
            return True
        pause.wait(0.005)
    return check()
