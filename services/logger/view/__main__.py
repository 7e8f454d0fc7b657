"""The view's process: `python -m services.logger.view SETTINGS`, records on standard input, what it has to say on standard output.

Ends when its input ends.
"""

import signal
import struct
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from typing import BinaryIO

import msgspec
import rerun as rr

from drivemcp.files.modes import deny_others
from services.logger.view.drawing import Drawing
from services.logger.view.server import Server
from services.logger.view.settings import Said, Shown, ViewSettings

LENGTH = struct.Struct("<I")


def main() -> int:
    """Draws until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is the logger's to hear; it ends our input
    deny_others()  # a recording holds pictures
    settings = msgspec.json.decode(sys.argv[1].encode(), type=ViewSettings)
    try:
        with ExitStack() as stack:
            sinks: list[rr.GrpcSink | rr.FileSink] = []
            page = ""
            if settings.mode == "web":
                server = stack.enter_context(Server(settings))
                sinks.append(rr.GrpcSink(server.sink))
                page = server.page
            if settings.recording:
                sinks.append(rr.FileSink(settings.recording))
            stream = rr.RecordingStream("drivemcp")
            stream.set_sinks(*sinks)
            drawing = Drawing(stream)
            say(Said(viewer=page or settings.recording))
            draw(drawing, sys.stdin.buffer)
            stream.flush()
            stream.disconnect()
    except (RuntimeError, OSError) as error:  # Rerun raises RuntimeError where it cannot write
        say(Said(problem=str(error)))
        return 1
    return 0


def draw(drawing: Drawing, source: BinaryIO) -> None:
    """Every record that comes; one that cannot be drawn is said once and passed over."""
    complained = False
    for shown in records(source):
        try:
            drawing.record(shown.topic, shown.name, shown.stamp_ns, shown.data)
        except ValueError as error:
            if not complained:
                say(Said(problem=f"{shown.name} cannot be drawn: {error}"))
            complained = True


def records(source: BinaryIO) -> Iterator[Shown]:
    """The records of the pipe, until it ends."""
    decoder = msgspec.msgpack.Decoder(Shown)
    while len(head := source.read(LENGTH.size)) == LENGTH.size:
        yield decoder.decode(source.read(LENGTH.unpack(head)[0]))


def say(said: Said) -> None:
    """One line to the logger."""
    sys.stdout.write(msgspec.json.encode(said).decode() + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
