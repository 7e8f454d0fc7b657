"""Binds the log, the long-term memory and the live view to the bus; decides nothing."""

import sqlite3
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec

from drivemcp.bus.received import Received
from drivemcp.config import ServiceConfig
from drivemcp.errors import ToolFailed, UserError
from drivemcp.node import Node
from drivemcp.paths import own_state
from drivemcp.service import Service
from proto import topics
from proto.topics import Topic
from services.logger.format import signing
from services.logger.memory import Kind, Memory, MemoryStore, TraceQuery, TraceRow
from services.logger.verification import trust
from services.logger.view.pipe import ViewPipe
from services.logger.view.settings import Said, ViewSettings
from services.logger.writing.anchor import Anchor
from services.logger.writing.log_folder import Retention
from services.logger.writing.recorder import HeadKeeper, PictureGate, Pictures, Recorder
from services.logger.writing.time_stamps import TimeStamps
from services.logger.writing.topic_formats import LOGGED
from services.logger.writing.withheld import Withholding
from services.logger.writing.writer import LogWriter, WriterSettings

T = TypeVar("T")
# both bounds, so that no NaN gets through
Around = Annotated[float, msgspec.Meta(ge=0.0, le=600.0)]
Bound = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]


class LoggerConfig(ServiceConfig, frozen=True, kw_only=True):
    """What is written where, how often, and for how long it is kept."""

    log_dir: str = ""
    """Folder of the logs. Empty: `out_dir/logs`."""
    secret_dir: str = ""
    """Where the signing key lies; empty: `drivemcp/log-keys` in the user's state folder, never in a drive's folder."""
    anchor_file: str = ""
    """Signed heads are also appended to this file, which should be elsewhere and append-only; empty: none."""
    anchor_s: Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)] = 10.0
    """Least time between two heads in `anchor_file`."""
    stamp_url: str = ""
    """Address (http, https) of an authority for time stamps (RFC 3161) of signed heads; empty: none."""
    stamp_s: Annotated[float, msgspec.Meta(ge=0.0, le=1e6)] = 600.0
    """Least time between two time stamps; 0: of each file's last head alone."""
    memory_file: str = ""
    """Long-term memory. Empty: `out_dir/memory.sqlite`."""
    pictures: Pictures = "all"
    """`events`: only pictures around ticks that were not SILENT."""
    pictures_before_s: Around = 5.0
    """With `events`: from so long before such a tick."""
    pictures_after_s: Around = 5.0
    """With `events`: to so long after it."""
    flush_ms: Annotated[float, msgspec.Meta(ge=1.0, le=60_000.0)] = 100.0
    """At most 100 counts; a flush is half of what a kill -9 may cost."""
    fsync_s: Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)] = 1.0
    """How much a loss of power may cost; a kill of the process does not wait for it."""
    max_file_mb: Annotated[float, msgspec.Meta(ge=0.01, le=1e6)] = 512.0
    """A larger log goes on in a new file."""
    max_file_s: Annotated[float, msgspec.Meta(ge=1.0, le=1e8)] = 3600.0
    """So does a longer one."""
    max_total_mb: Bound = 20_000.0
    """The oldest files beyond it are deleted when a new one begins, and that is logged; 0: no bound."""
    max_age_days: Bound = 0.0
    """So are files older than this; 0: no bound."""
    queue_mb: Annotated[float, msgspec.Meta(ge=1.0, le=65_536.0)] = 64.0
    """What may wait to be written; more is lost and counted."""
    privacy: Literal["full", "minimal"] = "full"
    """`minimal`: no continuous record of speed, place and limit; what is left out is hashed. Each tick that spoke or braked is kept;
    pictures are kept around those alone, and no recording is written."""
    view: ViewSettings = ViewSettings()


class Recalled(msgspec.Struct, frozen=True, kw_only=True):
    """What was remembered, newest first."""

    entries: tuple[Memory, ...]


class Remembered(msgspec.Struct, frozen=True, kw_only=True):
    """The number of the new memory."""

    id: int


class FoundTraces(msgspec.Struct, frozen=True, kw_only=True):
    """Ticks that fit, newest first."""

    traces: tuple[TraceRow, ...]


def build(config: LoggerConfig, node: Node) -> None:
    """Starts the writer and the view, subscribes to what the topic table wants logged, offers memory as tools."""
    out = Path(config.out_dir)
    memory = _open_memory(Path(config.memory_file) if config.memory_file else out / "memory.sqlite", node)
    signer = _signer(config)
    view = _start_view(config, node)

    log_dir = Path(config.log_dir) if config.log_dir else out / "logs"
    keepers = tuple(_keepers(config, node, signer, log_dir))
    recorder = Recorder(
        memory=memory,
        pictures=PictureGate(
            "events" if config.privacy == "minimal" and config.pictures == "all" else config.pictures,
            before_ns=int(config.pictures_before_s * 1e9),
            after_ns=int(config.pictures_after_s * 1e9),
        ),
        show=view.offer if view else lambda topic, record: None,
        warn=node.log.warning,
        keepers=keepers,
        withholding=Withholding(signer.withholding_key()) if config.privacy == "minimal" else None,
    )
    writer = LogWriter(
        _writer_settings(config, log_dir),
        signer,
        recorder,
        now_ns=node.clock.now_ns,
    )
    recorder.put = writer.put
    writer.start()
    for topic in LOGGED:
        node.subscribe_raw(topic, _take(topic, recorder, node, config.vehicle))
    if memory is not None:
        _offer_tools(node, memory)
    node.every(1.0, lambda: _report(node, log_dir, recorder, writer, view))
    node.on_close(lambda: _close(node, recorder, writer, view, memory, keepers))


def _take(
    topic: Topic[msgspec.Struct], recorder: Recorder, node: Node, vehicle: str
) -> Callable[[Received[Any]], None]:
    prefix = len(f"drivemcp/{vehicle}/")

    def take(info: Received[Any]) -> None:
        recorder.take(
            topic,
            info.key[prefix:],
            info.payload,
            sequence=info.seq,
            stamp_ns=info.stamp_ns,
            now_ns=node.clock.now_ns(),
        )

    return take


Limit = Annotated[int, msgspec.Meta(ge=1, le=500, description="number of entries at most", examples=[20])]
Nanoseconds = Annotated[
    int, msgspec.Meta(ge=0, description="ns since 1970; 0: no bound", examples=[1_780_000_000_000_000_000])
]


def _offer_tools(node: Node, memory: MemoryStore) -> None:
    @node.tool(deadline_ms=100, title="Recall from long-term memory")
    def recall(
        kind: Annotated[Kind, msgspec.Meta(description="what kind of memory")],
        key: Annotated[str, msgspec.Meta(description="its key; empty: every key", examples=["driver"])] = "",
        limit: Limit = 20,
    ) -> Recalled:
        """What long-term memory holds of a kind, newest first: the newest counts, the older are its history."""
        return Recalled(entries=_asked(lambda: memory.recall(kind, key, limit=limit)))

    @node.tool(
        deadline_ms=100, title="Remember for later drives", capability="diagnostic", read_only=False, idempotent=False
    )
    def remember(
        kind: Annotated[Kind, msgspec.Meta(description="what kind of memory")],
        key: Annotated[
            str, msgspec.Meta(min_length=1, max_length=200, description="what it is found by", examples=["garage"])
        ],
        value: Annotated[
            dict[str, Any], msgspec.Meta(description="an object of at most 64 KiB", examples=[{"door": "left"}])
        ],
    ) -> Remembered:
        """Keeps something for later drives. Nothing is overwritten: the newest of a key counts."""
        return Remembered(id=_asked(lambda: memory.remember(kind, key, value, stamp_ns=node.clock.now_ns())))

    @node.tool(deadline_ms=200, title="Find traces of past ticks")
    def find_traces(
        event: Annotated[str, msgspec.Meta(description="kind of an event of the tick", examples=["overspeed"])] = "",
        decision: Annotated[str, msgspec.Meta(description="SILENT, SPEAK or ACT", examples=["SPEAK"])] = "",
        text: Annotated[str, msgspec.Meta(description="part of what was said", examples=["limit"])] = "",
        after_ns: Nanoseconds = 0,
        before_ns: Nanoseconds = 0,
        limit: Limit = 20,
    ) -> FoundTraces:
        """Ticks by event, decision, words and time, newest first, with the log file that holds each whole trace."""
        query = TraceQuery(
            event=event, decision=decision, text=text, after_ns=after_ns, before_ns=before_ns, limit=limit
        )
        return FoundTraces(traces=_asked(lambda: memory.find_traces(query)))


def _asked(question: Callable[[], T]) -> T:
    try:
        return question()
    except (sqlite3.Error, ValueError) as error:
        raise ToolFailed(f"long-term memory does not answer: {error}", do="mend the value, or free the disk") from error


def _report(node: Node, log_dir: Path, recorder: Recorder, writer: LogWriter, view: ViewPipe | None) -> None:
    """Once a second: the newest head onto the bus, the state of the log into this service's health."""
    tally = writer.tally
    node.detail.update(
        log=str(log_dir / tally.file) if tally.file else "",
        log_messages=str(tally.messages),
        log_lost=str(tally.lost),
        log_waiting=str(writer.waiting),
        log_malformed=str(recorder.malformed.total()),
        log_misstamped=str(recorder.misstamped.total()),
        log_mb_per_hour=f"{writer.mb_per_hour():.0f}",
        log_worst_flush_ms=f"{tally.worst_flush_ms:.0f}",
        log_trouble=tally.trouble if writer.running else "the writer has stopped",
    )
    if view is not None:
        node.detail["view_dropped"] = str(view.dropped)
    if recorder.head is not None:
        node.publish(topics.CHAIN, recorder.head)


def _close(
    node: Node,
    recorder: Recorder,
    writer: LogWriter,
    view: ViewPipe | None,
    memory: MemoryStore | None,
    keepers: Sequence[HeadKeeper],
) -> None:
    recorder.end()
    if node.unhandled:
        writer.missed(node.unhandled, "the logger was ended before it had taken them in")
    if not writer.close():
        node.log.error("the log was not closed in order: %s", writer.tally.trouble or "the disk is too slow")
    for keeper in keepers:
        if isinstance(keeper, TimeStamps):
            keeper.close()
    if view is not None:
        view.close()
    if memory is not None:
        memory.close()
    node.log.info(
        "log closed",
        extra={"fields": {"messages": writer.tally.messages, "lost": writer.tally.lost, "file": writer.tally.file}},
    )


def _writer_settings(config: LoggerConfig, log_dir: Path) -> WriterSettings:
    return WriterSettings(
        directory=log_dir,
        vehicle=config.vehicle,
        flush_ms=config.flush_ms,
        fsync_s=config.fsync_s,
        max_file_mb=config.max_file_mb,
        max_file_s=config.max_file_s,
        queue_mb=config.queue_mb,
        retention=Retention(max_total_mb=config.max_total_mb, max_age_days=config.max_age_days),
    )


def _signer(config: LoggerConfig) -> signing.Signer:
    """The signer; a key that is made in the user's own folder is one that this user trusts from then on."""
    directory = Path(config.secret_dir) if config.secret_dir else own_state(signing.FOLDER)
    new = not (directory / signing.PRIVATE_NAME).exists()
    try:
        signer = signing.load_or_make(directory)
        if new and not config.secret_dir:
            trust.add(trust.own_file(), trust.Trusted(public_key=signer.public_hex, note="made by the logger here"))
    except (OSError, ValueError) as error:
        raise UserError(
            f"no key to sign the log with in {directory}: {error}; set secret_dir to a folder of yours"
        ) from None
    return signer


def _keepers(config: LoggerConfig, node: Node, signer: signing.Signer, log_dir: Path) -> Iterator[HeadKeeper]:
    """Where heads are kept besides the log. What they cannot do stands in the health, and costs no record. Raises UserError."""

    def failed(detail: str) -> Callable[[str], None]:
        def tell(problem: str) -> None:
            node.detail[detail] = problem
            if problem:
                node.log.warning(problem)

        return tell

    if config.anchor_file:
        yield Anchor(Path(config.anchor_file), signer, every_s=config.anchor_s, failed=failed("anchor_trouble"))
    if config.stamp_url:
        try:
            yield TimeStamps(config.stamp_url, log_dir, every_s=config.stamp_s, failed=failed("stamp_trouble"))
        except ValueError as error:
            raise UserError(f"stamp_url: {error}") from None


def _open_memory(path: Path, node: Node) -> MemoryStore | None:
    """Without its database the service still logs, and says so."""
    try:
        return MemoryStore(path)
    except (sqlite3.Error, OSError) as error:
        node.log.error("no long-term memory: %s cannot be used: %s", path, error)
        node.detail["memory"] = f"unusable: {error}"
        return None


def _start_view(config: LoggerConfig, node: Node) -> ViewPipe | None:
    settings = config.view
    if config.privacy == "minimal" and (settings.mode == "file" or settings.recording):
        node.log.warning("privacy is minimal: no recording of the drive is written")
        settings = msgspec.structs.replace(settings, recording="", mode="off" if settings.mode == "file" else "web")
    if settings.mode == "off":
        return None
    if settings.mode == "file" and not settings.recording:
        stamp = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
        Path(config.out_dir).mkdir(parents=True, exist_ok=True)
        settings = msgspec.structs.replace(settings, recording=str(Path(config.out_dir) / f"view-{stamp}.rrd"))

    def said(what: Said) -> None:
        if what.viewer:
            node.detail["viewer"] = what.viewer
            node.log.info("live view", extra={"fields": {"viewer": what.viewer}})
        else:
            node.detail["viewer_problem"] = what.problem
            node.log.warning("live view: %s", what.problem)

    return ViewPipe(settings, said=said)


SERVICE = Service("logger", LoggerConfig, build)
