"""What can be found wrong before anything starts: names, numbers, files, ports, grants. Each raises UserError."""

import argparse
import socket
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from drivemcp.config import settings_of
from drivemcp.errors import UserError
from drivemcp.registry import load_service, service_rows
from drivemcp.runtime.grant_watch import TrustedKeys
from drivemcp.runtime.grants import GrantRefused, public_key, read_grant, verify_grant
from proto import topics
from proto.keys import chunk

if TYPE_CHECKING:
    from services.arbiter.profiles.profile import Profile
    from services.simulator.scenario.plan import Scenario


def check_asked(flags: argparse.Namespace) -> None:
    """The services and settings of a command line, before ours are added: these need no check, which takes time."""
    settings = settings_of(flags.set)
    check_services(flags.without, flags.extra, settings)
    check_settings({service: given for service, given in settings.items() if service not in flags.without})


def check_services(without: Sequence[str], extra: Sequence[str], settings: Mapping[str, Any]) -> None:
    """Every service that is named is one."""
    table = service_rows()
    for name in (*without, *extra, *settings):
        if name not in table:
            raise UserError(
                f"no service {name!r}; there are {', '.join(sorted(table))}; a third party's has to be installed first"
            )


def check_settings(settings: Mapping[str, Mapping[str, Any]], *, strict: bool = False) -> None:
    """Each service would take its settings (strictly: the text "3" is no number). What only a running service can tell, it tells."""
    for name, given in settings.items():
        try:
            msgspec.convert(given, load_service(name).config, strict=strict)
        except msgspec.ValidationError as error:
            raise UserError(f"--set {name}: {error}") from None
    if "profile" in (arbiter := settings.get("arbiter", {})):
        profile_of("--set arbiter.profile", arbiter["profile"])


def profile_of(flag: str, name: str) -> "Profile":
    """The arbiter's profile that a flag names."""
    from services.arbiter.profiles.errors import ProfileError
    from services.arbiter.profiles.profile import load, names

    try:
        return load(name)
    except ProfileError as error:
        raise UserError(f"{flag}: {error}") from None
    except OSError as error:
        raise UserError(f"{flag} {name}: {error.strerror}; there are {', '.join(names())}, or name a file") from None


def check_port(port: int) -> None:
    """A port that was asked for is free."""
    if not port:
        return
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise UserError(f"port {port}: {error.strerror}; leave --port out for a free one") from None


def check_voice(cockpit: Mapping[str, Any]) -> None:
    """A command that speaks is there."""
    from services.cockpit.speech.commands import speech_command

    speech_command(str(cockpit.get("speech_command", "")), recorded=bool(cockpit.get("wav")))


def vehicle_of(flags: argparse.Namespace) -> str:
    """The vehicle's name: the one asked for, else the grant's; empty: one is made up. A grant must count for it."""
    keys, keys_file = trusted(flags.trust)
    vehicle = str(flags.vehicle)
    if flags.grant:
        try:
            data = Path(flags.grant).read_bytes()
        except OSError as error:
            raise UserError(f"cannot read the grant {flags.grant}: {error.strerror}") from None
        grant = read_grant(data)
        vehicle = vehicle or grant.vehicle
        counting = TrustedKeys(keys, keys_file).current()
        verify_grant(grant, counting, vehicle=vehicle, capability=topics.BRAKE.name, now=datetime.now(UTC))
    try:
        return chunk(vehicle) if vehicle else ""
    except ValueError as error:
        raise UserError(f"--vehicle: {error}") from None


def trusted(given: Sequence[str]) -> tuple[list[str], str]:
    """The public keys among what `--trust` was given, and the file of keys, of which there may be one."""
    files = [one for one in given if Path(one).is_file()]
    keys = [one for one in given if one not in files]
    if len(files) > 1:
        raise UserError("--trust takes one file of keys")
    file = str(Path(files[0]).resolve()) if files else ""
    try:
        for key in keys:
            public_key(key)
        TrustedKeys(file=file).current()
    except GrantRefused as error:
        raise UserError(f"--trust: {error}") from None
    return keys, file


def check_scenario(path: Path) -> "Scenario":
    """The scenario of a file that can be driven."""
    from services.simulator.scenario.load import ScenarioError, load_scenario

    try:
        return load_scenario(path)
    except (ScenarioError, OSError) as error:
        raise UserError(str(error)) from None


def check_faults(texts: Iterable[str]) -> None:
    """Faults of the car that the simulator knows."""
    from services.simulator.scenario.load import read_fault

    try:
        for text in texts:
            read_fault(text)
    except ValueError as error:
        raise UserError(f"--fault: {error}") from None


def check_folder_of(paths: Iterable[str]) -> None:
    """Files that are to be written have a folder."""
    for path in paths:
        if not Path(path).resolve().parent.is_dir():
            raise UserError(f"cannot write {path}: there is no folder {Path(path).parent}")
