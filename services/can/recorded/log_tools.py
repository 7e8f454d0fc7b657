"""The tools of Peykan's catalogue that read recorded logs, by its names and shapes."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import msgspec

from drivemcp.errors import UserError
from drivemcp.node import Node
from services.can.recorded.analysis import LogAnalysis, analyse
from services.can.recorded.folder import LogFile, LogFolder
from services.can.recorded.series import LogSeries, series
from services.can.vehicle import Vehicle

DEADLINE_MS = 40_000.0
"""Twenty seconds of reading, the size of a packed log, and what one record may take."""

LogPath = Annotated[
    str,
    msgspec.Meta(
        min_length=1, max_length=300, description="a log as list_can_logs names it", examples=["drive-7/engine.blf"]
    ),
]
SignalName = Annotated[
    str,
    msgspec.Meta(
        max_length=128, description="signal of the log; analyze_can_log lists them", examples=["VehicleSpeed"]
    ),
]
Points = Annotated[
    int, msgspec.Meta(ge=2, le=1000, description="greatest number of points, evenly chosen", examples=[100])
]
MessageName = Annotated[
    str | None, msgspec.Meta(description="which message, where several carry the signal", examples=["Motion"])
]


class LogList(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The logs that may be read; `message` says why no log may be read, or that there are more."""

    log_dir: str
    files: list[LogFile]
    message: str | None = None


class AnalysisAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok or error."""

    status: str
    analysis: LogAnalysis | None = None
    message: str | None = None


class SeriesAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok or error."""

    status: str
    series: LogSeries | None = None
    message: str | None = None


def offer(node: Node, vehicle: Vehicle, log_folder: str) -> None:
    """Add them to the node."""
    folder, reading = LogFolder(log_folder), threading.Lock()

    @contextmanager
    def alone() -> Iterator[None]:
        """One log at a time: the service's other threads stay free for tools that a drive waits for."""
        if not reading.acquire(blocking=False):
            raise UserError("another log is being read; ask again when its answer is there")
        try:
            yield
        finally:
            reading.release()

    @node.tool(deadline_ms=1000)
    def list_can_logs() -> LogList:
        """The recorded CAN logs that may be read: below the configured folder and its folders, at most 200."""
        try:
            files, more = folder.files()
        except UserError as error:
            return LogList(log_dir=folder.name, files=[], message=str(error))
        return LogList(
            log_dir=folder.name, files=files, message="there are more; the first are listed" if more else None
        )

    @node.tool(deadline_ms=DEADLINE_MS)
    def analyze_can_log(path: LogPath) -> AnalysisAnswer:
        """What a recorded log (.asc, .blf, .csv, .log, .mf4, .trc) holds: ids with rates, signals' ranges, trouble codes
        (OBD, UDS, J1939) with their time, silences. Reads at most 20 s and says so.
        """
        try:
            with alone():
                return AnalysisAnswer(status="ok", analysis=analyse(folder.find(path), vehicle))
        except UserError as error:
            return AnalysisAnswer(status="error", message=str(error))

    @node.tool(deadline_ms=DEADLINE_MS)
    def get_log_signal(
        path: LogPath, signal_name: SignalName, max_points: Points = 100, message: MessageName = None
    ) -> SeriesAnswer:
        """One signal of a recorded log over its time (s after its first frame), with least, greatest and mean."""
        try:
            with alone():
                found = series(folder.find(path), vehicle, signal_name, max_points, message or "")
            return SeriesAnswer(status="ok", series=found)
        except UserError as error:
            return SeriesAnswer(status="error", message=str(error))
