"""`drivemcp play SOURCE`: a recording through the same stack, and an annotated video of what it saw and said."""

import argparse
import sys
from pathlib import Path

from drivemcp.errors import UserError
from drivemcp.numbers import number
from evaluation.drive.command import add_common, drive
from evaluation.drive.precheck import check_folder_of
from evaluation.drive.render import render_video


def register(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = subparsers.add_parser("play", help="feed a video or a folder of pictures through the stack")
    parser.add_argument("source", help="a video file, or a folder of pictures in the order of their names")
    parser.add_argument(
        "--detector", metavar="FILE", help="a COCO-style YOLOX model (ONNX); ours knows rendered pictures only"
    )
    parser.add_argument("--seconds", type=number(0.0, 86_400.0), default=0.0, help="stop earlier")
    parser.add_argument(
        "--period", type=number(0.02, 3600.0), default=0.5, help="seconds between the pictures of a folder"
    )
    parser.add_argument(
        "--fov", type=number(5.0, 170.0), default=60.0, help="the camera's horizontal field of view, degrees"
    )
    parser.add_argument("--render", metavar="FILE.mp4", help="write an annotated video afterwards")
    add_common(parser)
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Play, then render. Ego speed and weather are unknown, and treated so."""
    source = Path(flags.source).resolve()
    if not source.exists():
        raise UserError(f"no such recording: {flags.source}")
    if flags.render and Path(flags.render).suffix != ".mp4":
        raise UserError(f"--render writes an .mp4 file, not {flags.render}")
    if flags.render:
        check_folder_of([flags.render])
    if flags.detector:
        if not Path(flags.detector).is_file():
            raise UserError(f"no such model: {flags.detector}")
        flags.set.append(f"perception.detector={Path(flags.detector).resolve()}")
    else:
        sys.stderr.write("our own detector knows rendered pictures only; for photographs give --detector FILE.onnx\n")
    settings = {
        "source": str(source), "seconds": flags.seconds, "picture_period_s": flags.period, "fov_deg": flags.fov,
    }  # fmt: skip
    status, folder = drive(flags, source.stem or source.name, "player", settings, flags.seconds, lockstep=False)
    if flags.render:
        frames = render_video(sorted((folder / "logs").glob("*.mcap")), Path(flags.render))
        sys.stderr.write(f"{frames} pictures rendered into {flags.render}\n")
    return status
