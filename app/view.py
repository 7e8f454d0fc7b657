"""`drivemcp view FILE...`: old logs in the viewer, or as a Rerun recording."""

import argparse
import sys

from drivemcp.commands import Subparsers
from drivemcp.files.modes import others_denied
from drivemcp.numbers import number, port
from services.logger.writing import log_folder


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp view`."""
    parser = subparsers.add_parser("view", help="show old logs in the viewer, or write them as a Rerun recording")
    parser.add_argument(
        "files", metavar="FILE", nargs="+", help="the logs (.mcap) of a drive in order, their folder, or the drive's"
    )
    parser.add_argument("--recording", metavar="FILE", default="", help="write a .rrd file instead of serving")
    parser.add_argument(
        "--bind", default="127.0.0.1", help="address to serve on; other than loopback shows it to the network"
    )
    parser.add_argument("--port", type=port, default=0, help="port of the page; a free one by default")
    parser.add_argument(
        "--image-hz", type=number(0.0, 1000.0), default=5.0, metavar="HZ", help="pictures a second and camera; 0: all"
    )
    parser.set_defaults(run=_view)


def _view(flags: argparse.Namespace) -> int:
    from services.logger.view.old import show  # the view's packages are large

    with others_denied():  # a recording holds pictures
        return show(
            log_folder.named(flags.files),
            recording=flags.recording,
            bind=flags.bind,
            web_port=flags.port,
            image_hz=flags.image_hz,
            say=_say,
        )


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
