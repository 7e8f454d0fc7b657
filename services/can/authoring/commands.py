"""`drivemcp can profile new DBC` and `drivemcp can profile check PROFILE`."""

import argparse
import itertools
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from proto.sensors import CanFrame
from services.can.authoring.drive_check import DriveReport, Shown, check_drive
from services.can.authoring.scaffold import Found, guards, render, search
from services.can.authoring.signal_matching import HINTS
from services.can.errors import ProfileError
from services.can.profiles.curated import FIELDS
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile, find_descriptions, load_profile
from services.can.signals.board import Board

NEVER_SEEN = "never seen: is the message on this bus?"


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp can`."""
    parser = subparsers.add_parser("can", help="make and check the profile of a car")
    kinds = parser.add_subparsers(metavar="COMMAND", required=True)
    profiles = kinds.add_parser("profile", help="which signal feeds which field").add_subparsers(
        metavar="COMMAND", required=True
    )
    _new(profiles)
    _check(profiles)


def _new(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser("new", help="write a first profile from a bus description, its guesses marked")
    parser.add_argument("description", metavar="DBC", type=Path, help="a DBC, ARXML, KCD or SYM file")
    parser.add_argument("--out", metavar="FOLDER", type=Path, help="where profile.toml goes (default: named after DBC)")
    parser.add_argument("--bus", metavar="NAME", default="can0", help="what the bus is called (default: can0)")
    parser.set_defaults(run=_run_new)


def _check(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser("check", help="check a profile against its descriptions, and against a drive's log")
    parser.add_argument("profile", metavar="PROFILE", type=Path)
    parser.add_argument(
        "--log", metavar="[BUS=]FILE", action="append", default=[], help="a recorded log, of one bus; may be repeated"
    )
    parser.add_argument(
        "--channel", metavar="[BUS=]CHANNEL", action="append", default=[],
        help="of a log that holds several buses, as python-can counts them; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--folder", metavar="FOLDER", type=Path, action="append", default=[], help="where descriptions lie"
    )
    parser.set_defaults(run=_run_check)


def _run_new(flags: argparse.Namespace) -> int:
    source: Path = flags.description
    folder: Path = flags.out or Path(source.stem)
    target = folder / "profile.toml"
    if target.exists():
        raise UserError(f"{target} is there already; give another folder by --out")
    try:
        dbc = Dbc(source, strict=False)
    except ProfileError as error:
        raise UserError(str(error)) from error
    found = search(dbc.messages.values())
    folder.mkdir(parents=True, exist_ok=True)
    target.write_text(render(folder.name, flags.bus, source, folder, found), encoding="utf-8")
    for each in found:
        sys.stdout.write(f"{_row(each)}\n")
    chosen = sum(each.chosen is not None for each in found)
    unsure = sum(each.chosen is None and bool(each.others) for each in found)
    sys.stdout.write(
        f"\n{target}: {chosen} fields guessed, {unsure} unsure (commented out), {len(found) - chosen - unsure} missing.\n"
        "Nothing in it is verified. Next: drivemcp can profile check "
        f"{target} --log A_RECORDED_DRIVE\n"
    )
    return 0


def _row(found: Found) -> str:
    if found.chosen is not None:
        checksums = guards(found.chosen.message)
        note = f"  (checksum {', '.join(checksums)}: kind unknown)" if checksums else ""
        return f"{found.field:28} guessed  {found.chosen.place}  {found.chosen.score:g}{note}"
    if found.others:
        return f"{found.field:28} unsure   {', '.join(each.place for each in found.others)}"
    return f"{found.field:28} missing"


def _run_check(flags: argparse.Namespace) -> int:
    path: Path = flags.profile
    try:
        profile = load_profile(path)
        descriptions = {
            bus: Dbc(*files, strict=profile.buses[bus].strict, protocol=profile.buses[bus].protocol)
            for bus, files in find_descriptions(profile, path, tuple(flags.folder)).items()
        }
        Board(descriptions, profile)
    except ProfileError as error:
        raise UserError(str(error)) from error
    missing = [name for name in HINTS if name not in profile.fields]
    sys.stdout.write(f"{path}: sound. {len(profile.fields)} of {len(FIELDS)} curated fields.\n")
    sys.stdout.write(f"not on this car: {', '.join(missing) or 'none'}\n")
    if not flags.log:
        return 0
    report = check_drive(profile, descriptions, _frames(*_logs(flags, profile)))
    return _tell(profile, report)


def _logs(flags: argparse.Namespace, profile: Profile) -> tuple[dict[str, Path], dict[str, str]]:
    logs = _by_bus("--log", flags.log, profile)
    return {bus: Path(name) for bus, name in logs.items()}, _by_bus("--channel", flags.channel, profile)


def _by_bus(option: str, texts: list[str], profile: Profile) -> dict[str, str]:
    found: dict[str, str] = {}
    for text in texts:
        bus, _, value = text.rpartition("=")
        if bus not in profile.buses and (bus or len(profile.buses) > 1):
            raise UserError(f"{option} {text}: say of which bus, as BUS=...; there are {', '.join(profile.buses)}")
        found[bus or next(iter(profile.buses))] = value
    return found


def _frames(logs: Mapping[str, Path], channels: Mapping[str, str]) -> Iterator[tuple[str, CanFrame]]:
    """Frames of every log in the order of their stamps; what cannot be read is told at the end."""
    from drivemcp.files.can_logs.log import CanLog, check_channel, check_log

    for bus, path in logs.items():
        check_log(path, f"--log {bus}")
        check_channel(path, channels.get(bus, ""), f"--channel {bus}=CHANNEL")
    opened = {bus: CanLog(path, channels.get(bus, "")) for bus, path in logs.items()}
    streams = [[(record.at_s, bus, record.frame) for record in log] for bus, log in opened.items()]
    for at_s, bus, frame in sorted(itertools.chain.from_iterable(streams), key=lambda each: each[0]):
        yield bus, _stamped(frame, 1_000_000_000 + round(at_s * 1e9))
    for log, stream in zip(opened.values(), streams, strict=True):
        if not stream:
            raise UserError(f"{log.path.name} holds no frame: {log.nothing}")
        if log.summary:
            sys.stdout.write(f"{log.path.name}: {log.summary}\n")


def _stamped(frame: CanFrame, stamp_ns: int) -> CanFrame:
    from msgspec.structs import replace

    return replace(frame, stamp_ns=stamp_ns)


def _tell(profile: Profile, report: DriveReport) -> int:
    sys.stdout.write(f"\n{report.frames} frames in {report.seconds:.1f} s\n")
    sys.stdout.write(f"{'field':28} {'Hz':>6} {'rejected':>8} {'lowest':>9} {'highest':>9} unit\n")
    for name, shown in report.fields.items():
        sys.stdout.write(f"{name:28} {_numbers(shown)} {profile.fields[name].unit}{_why(shown)}".rstrip() + "\n")
    if report.agreements:
        sys.stdout.write("\nsigns and units, each field against others:\n")
    for each in report.agreements:
        sys.stdout.write(f"{each.field:28} {each.verdict}  (against {each.against}: {each.correlation:+.2f})\n")
    wrong = any(not shown.samples or shown.low is None for shown in report.fields.values())
    return int(wrong or any(each.verdict not in ("agrees", "unclear") for each in report.agreements))


def _numbers(shown: Shown) -> str:
    share = sum(shown.rejected.values()) / shown.samples if shown.samples else 0.0
    low, high = (f"{each:9.3g}" if each is not None else f"{'-':>9}" for each in (shown.low, shown.high))
    return f"{shown.hz:6.1f} {share:8.1%} {low} {high}"


def _why(shown: Shown) -> str:
    if not shown.samples:
        return f"  {NEVER_SEEN}"
    return "  " + ", ".join(f"{reason} {count}x" for reason, count in shown.rejected.items()) if shown.rejected else ""
