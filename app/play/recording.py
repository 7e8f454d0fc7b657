"""A recording, checked, through the stack, and rendered afterwards: what `drivemcp play` does."""

import argparse
import sys
import tempfile
from pathlib import Path

from app.drive.precheck import check_asked, check_folder_of
from app.drive.run import drive
from app.play.render import render_video
from drivemcp.errors import UserError
from drivemcp.files.can_logs.log import CanLog
from drivemcp.files.models import find_model
from services.player.can_log import SpeedSignal, log_beside, open_log, profile_of, speed_signal
from services.player.drive_log import log_files
from services.player.pictures import check_webcam, passed_over, webcam_number
from services.player.position_track import not_read, read_track, track_beside
from services.player.recording import Options, Recording
from services.player.source import open_recording

DECIDING = ("orchestrator", "arbiter", "rules", "retrieval", "weather", "gateway", "cockpit")
"""What `--record-only` does not start: player, CAN, perception, front end and logger remain."""


def play(flags: argparse.Namespace) -> int:
    """Play, then render. Raises UserError."""
    check_asked(flags)
    if flags.render and Path(flags.render).suffix != ".mp4":
        raise UserError(f"--render writes an .mp4 file, not {flags.render}")
    if flags.render:
        check_folder_of([flags.render])
    webcam = webcam_number(flags.source)
    source = flags.source if webcam is not None else str(Path(flags.source).resolve())
    recording = checked(source)
    log, speed = can_log_of(flags, source, recording)
    track = track_of(flags, source)
    _choose_detector(flags, source)
    if flags.record_only:
        flags.without = [*flags.without, *(name for name in DECIDING if name not in flags.without)]
    if log is None and ((recording is not None and recording.ego) or track is not None):
        flags.without = [*flags.without, *({"can"} - set(flags.without))]
    if recording is not None and (left := passed_over(Path(source))):
        sys.stderr.write(f"{left}\n")
    sys.stderr.write(f"ego speed: {_speed_from(recording, log, speed, track)}\n")
    settings = {
        "source": source, "seconds": flags.seconds, "picture_period_s": flags.period, "fov_deg": flags.fov,
        "hold_s": flags.seconds or Options().hold_s, "can_log": str(log.path) if log else "", "can_channel": log.channel if log else "",
        "can_offset_s": flags.can_offset,
        "track": str(track or ""), "track_offset_s": flags.track_offset,
    }  # fmt: skip
    name = f"webcam{webcam}" if webcam is not None else Path(source).stem
    with tempfile.TemporaryDirectory(prefix="drivemcp-") as folder:
        if speed is not None:
            flags.set = [*_can_settings(Path(folder), speed, flags), *flags.set]
        status, drive_folder = drive(flags, name, "player", settings, lockstep=False)
    if flags.render:
        frames = render_video(sorted((drive_folder / "logs").glob("*.mcap")), Path(flags.render))
        sys.stderr.write(f"{frames} pictures rendered into {flags.render}\n")
    return status


def checked(source: str) -> Recording | None:
    """What the recording brings, found wrong before anything starts; None for a webcam. Raises UserError."""
    webcam = webcam_number(source)
    if webcam is not None:
        check_webcam(webcam)
        return None
    return open_recording(source, Options())


def can_log_of(
    flags: argparse.Namespace, source: str, recording: Recording | None
) -> tuple[CanLog | None, SpeedSignal | None]:
    """The CAN log that was named or lies beside the recording, and the speed in it. Raises UserError."""
    path = _named_log(flags) if flags.can else None
    if recording is not None and not recording.ego and not flags.can:
        path = log_beside(Path(source))
    if path is None:
        if flags.dbc or flags.speed_signal:
            raise UserError("--dbc and --speed-signal read a CAN log, and no log is named: name it with --can FILE")
        return None, None
    dbc = Path(flags.dbc) if flags.dbc else None
    speed = speed_signal(dbc, flags.speed_signal, flags.speed_unit)
    return open_log(path, speed, flags.can_channel), speed


def track_of(flags: argparse.Namespace, source: str) -> Path | None:
    """The position track that was named or lies beside the recording, found sound. Raises UserError."""
    if flags.track == "none":
        return None
    if not flags.track:
        return track_beside(Path(source))
    read_track(Path(flags.track))
    return Path(flags.track).resolve()


def _named_log(flags: argparse.Namespace) -> Path | None:
    if flags.can == "none":
        return None
    if not Path(flags.can).is_file():
        raise UserError(f"no such CAN log: {flags.can}")
    return Path(flags.can).resolve()


def _can_settings(folder: Path, speed: SpeedSignal, flags: argparse.Namespace) -> list[str]:
    """Settings of the CAN service: nothing is asked of a bus that is only a recording; another DBC gets its own profile."""
    settings = ["can.poll_dtcs_s=0"]
    if flags.dbc or flags.speed_signal or flags.speed_unit:
        profile = folder / "profile.toml"
        profile.write_text(profile_of(speed), encoding="utf-8")
        settings.append(f"can.profile={profile}")
    return settings


def _choose_detector(flags: argparse.Namespace, source: str) -> None:
    if flags.detector:
        flags.set = [*flags.set, f"perception.detector={find_model(flags.detector)}"]
    elif webcam_number(source) is not None or not log_files(Path(source)):
        sys.stderr.write(
            "our own detector misses people in photographs: drivemcp models pull yolox-nano, then --detector yolox-nano, finds more\n"
        )


def _speed_from(recording: Recording | None, log: CanLog | None, speed: SpeedSignal | None, track: Path | None) -> str:
    if log is not None and speed is not None:
        return "; ".join(filter(None, (f"{speed.signal} of {speed.dbc.name} in {log.path.name}", log.summary)))
    if recording is not None and recording.ego:
        return "from the recording"
    return (
        "unknown"
        if track is None
        else "; ".join(filter(None, (f"from the positions in {track.name}", not_read(track))))
    )
