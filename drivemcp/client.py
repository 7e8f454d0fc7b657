"""A short-lived node for commands: joins a running stack, asks, and leaves."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec

from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.errors import MALFORMED, UserError
from drivemcp.node import Node
from proto.keys import chunk


class RunningStack(msgspec.Struct, frozen=True, kw_only=True):
    """What `drivemcp up` leaves for other commands while it runs."""

    endpoint: str
    vehicle: str
    folder: str
    pid: int
    viewer: str = ""
    user: str = ""
    password_file: str = ""


def state_file() -> Path:
    """Where the running stack is noted: in the user's runtime folder."""
    base = os.environ.get("XDG_RUNTIME_DIR") or os.environ.get("TMPDIR") or "/tmp"
    return Path(base) / f"drivemcp-{os.getuid()}" / "stack.json"


def note_stack(stack: RunningStack) -> None:
    """Note the running stack, readable by this user alone. Raises UserError where another may write there."""
    path = state_file()
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        _check_own(path.parent)
        scratch.write_bytes(msgspec.json.encode(stack))
        os.replace(scratch, path)
    except OSError as error:
        raise UserError(f"cannot note the running stack in {path}: {error.strerror}") from None


def _check_own(folder: Path) -> None:
    """Raises UserError unless it is a folder of this user's that no other user may enter; OSError where it does not exist."""
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid() or stat.S_IMODE(status.st_mode) & 0o077:
        raise UserError(f"{folder} is not yours alone: remove it, or set XDG_RUNTIME_DIR to a folder of yours")


def forget_stack(pid: int) -> None:
    """Remove the note if it is still ours."""
    with suppress(UserError):  # a folder that is not ours holds no note of ours
        stack = read_stack()
        if stack is not None and stack.pid == pid:
            state_file().unlink(missing_ok=True)


def read_stack() -> RunningStack | None:
    """The running stack, if one is noted and its process lives. Raises UserError where another may have written the note."""
    try:
        _check_own(state_file().parent)
        stack = msgspec.json.decode(state_file().read_bytes(), type=RunningStack)
        os.kill(stack.pid, 0)
    except (OSError, *MALFORMED):
        return None
    return stack


def _vehicle(name: str) -> str:
    try:
        return chunk(name)
    except ValueError as error:
        raise UserError(f"--vehicle: {error}") from None


@contextmanager
def join(connect: str | None = None, vehicle: str | None = None, name: str = "cli") -> Iterator[Node]:
    """A node on the given router, or on the stack that `drivemcp up` runs. Raises UserError without either."""
    stack = read_stack()
    if connect is None and stack is None:
        raise UserError("no stack is running here; start one with `drivemcp up`, or say where: --connect tcp/HOST:PORT")
    endpoint = connect or (stack.endpoint if stack else "")
    user, password = (stack.user, stack.password_file) if stack and stack.endpoint == endpoint else ("", "")
    bus_config = BusConfig(connect=(endpoint,), connect_timeout_s=5.0, user=user, password_file=password)
    config = ServiceConfig(vehicle=_vehicle(vehicle or (stack.vehicle if stack else "ego")), bus=bus_config)
    with open_bus(bus_config, log="off") as bus:
        node = Node(bus, name, config)
        node.open(announce=False)
        try:
            yield node
        finally:
            node.close()
