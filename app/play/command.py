"""`drivemcp play SOURCE`: a recording through the same stack, and an annotated video of what it saw and said."""

import argparse

from app.drive.run import add_common
from drivemcp.commands import Subparsers
from drivemcp.numbers import number


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "play",
        help="feed a recording or a webcam through the stack",
        description="Ego speed comes from the recording (frame.json, a log of ours), else from a CAN log beside it (VIDEO.asc beside "
        "VIDEO.mp4, or one inside the folder; .blf, .log, .mf4, .trc likewise), else from a position track "
        "(VIDEO.gpx, .nmea, .csv or .vbo) or the positions that the camera wrote into the video, else it is unknown, and treated so.",
    )
    parser.add_argument(
        "source",
        help="a video file, a folder of pictures in the order of their names, webcam:0, a frame.json with LiDAR and "
        "calibration or its folder, or a log of ours (FILE.mcap, or a drive's folder)",
    )
    parser.add_argument(
        "--detector",
        metavar="NAME|FILE",
        help="a model that was pulled (drivemcp models list), or a COCO-style ONNX file; ours finds more signs, fewer people",
    )
    parser.add_argument("--seconds", type=number(0.0, 86_400.0), default=0.0, help="stop earlier; a webcam never ends")
    parser.add_argument(
        "--period",
        type=number(0.02, 3600.0),
        default=0.0,
        help="seconds between the pictures of a folder; else by the times since 1970 in their names, else half a second",
    )
    parser.add_argument(
        "--fov",
        type=number(5.0, 170.0),
        default=0.0,
        help="the camera's horizontal field of view, degrees; where it is not given, ranges are in doubt",
    )
    parser.add_argument("--record-only", action="store_true", help="see and log, decide nothing")
    parser.add_argument("--render", metavar="FILE.mp4", help="write an annotated video afterwards")
    _add_can(parser)
    _add_track(parser)
    add_common(parser)
    parser.set_defaults(run=command)


def _add_can(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--can", default="", metavar="FILE", help="a CAN log for the ego speed; `none`: use none")
    parser.add_argument("--dbc", default="", metavar="FILE", help="the CAN log's bus description; ours by default")
    parser.add_argument(
        "--speed-signal",
        default="",
        metavar="NAME",
        help="the signal of --dbc that is the ego speed, as NAME or MESSAGE.NAME",
    )
    parser.add_argument(
        "--can-channel", default="", metavar="NAME", help="of a CAN log that holds several buses, the one of the speed"
    )
    parser.add_argument("--speed-unit", default="", metavar="UNIT", help="where the DBC does not say: km/h, m/s, mph")
    parser.add_argument(
        "--can-offset", type=number(-86_400.0, 86_400.0), default=0.0, metavar="S",
        help="the recording starts so many seconds after the CAN log's first frame",
    )  # fmt: skip


def _add_track(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--track",
        default="",
        metavar="FILE",
        help="positions for ego speed and country: .gpx, .nmea, .csv, .vbo, a video that holds them; `none`: use none",
    )
    parser.add_argument(
        "--track-offset", type=number(-86_400.0, 86_400.0), default=0.0, metavar="S",
        help="the recording starts so many seconds after the track's first fix",
    )  # fmt: skip


def command(flags: argparse.Namespace) -> int:
    """Play, then render."""
    from app.play.recording import play  # OpenCV takes its time: every other command would wait for it

    return play(flags)
