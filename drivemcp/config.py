"""Configuration: one frozen struct per service, read once, unknown keys refused."""

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec

from drivemcp.choices import explained
from drivemcp.errors import ConfigError
from proto.keys import chunk


class BusConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How to reach the others. Endpoints are explicit; nothing is searched for by multicast unless asked."""

    mode: Literal["client", "peer"] = "client"
    """`client` connects to a router; `peer` needs none."""
    connect: tuple[str, ...] = ()
    """Endpoints of routers, for example `tcp/127.0.0.1:7447`."""
    listen: tuple[str, ...] = ()
    """Endpoints that others may connect to."""
    multicast: bool = False
    """Peers are searched for by multicast."""
    user: str = ""
    """Name at the router."""
    password_file: str = ""
    """File that holds the user's password."""
    tls_folder: str = ""
    """For `tls/` endpoints: a folder with `ca.pem` and `tls.pem` (`drivemcp access FOLDER --tls NAME`)."""
    connect_timeout_s: Annotated[float, msgspec.Meta(gt=0.0, le=3600.0)] = 20.0
    """How long the start waits for a router; without one the service then ends with exit code 2."""


class ServiceConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every service may be told."""

    vehicle: str = "ego"
    """Name of the vehicle on the bus. Services with different names do not see each other."""
    bus: BusConfig = BusConfig()
    lockstep: bool = False
    """Time advances in steps that the simulator or player commands, so that a drive can be repeated exactly."""
    modelled_ms: dict[str, float] = {}
    """In lockstep: what a call of each tool takes, ms; one past its deadline is late. Tools not named: 4 ms."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """Least level of what is logged."""
    out_dir: str = "out"
    """Folder that logger and arbiter write to."""
    grant_file: str = ""
    """The grant (`drivemcp grant`) that the arbiter brakes by and the gateway calls by. The file is watched."""
    trusted_keys: tuple[str, ...] = ()
    """Public keys (base64) whose grants count."""
    trusted_keys_file: str = ""
    """A file with more of them, a line each; a key that leaves it ends its grants at once."""
    tool_workers: Annotated[int, msgspec.Meta(ge=1, le=256)] = 4
    """Threads that answer tool calls."""
    max_pending_calls: Annotated[int, msgspec.Meta(ge=0, le=10_000)] = 16
    """Calls that may wait for such a thread; one more is refused as busy."""
    heartbeat_file: str = ""
    """Touched every second by the worker thread; a container's health check looks at its age."""


C = TypeVar("C", bound=ServiceConfig)


def load_config(kind: type[C], file: str | None, settings: Sequence[str] = (), **overrides: Any) -> C:
    """The configuration from a TOML or JSON file, `key=value` settings (dots descend) and keyword overrides, in this order.

    Raises ConfigError naming the file and the field.
    """
    raw: dict[str, Any] = _read(Path(file)) if file else {}
    for setting in settings:
        assign(raw, setting)
    raw.update({name: value for name, value in overrides.items() if value is not None})
    try:
        config = msgspec.convert(raw, kind, strict=False)
        chunk(config.vehicle)
    except msgspec.ValidationError as error:
        raise ConfigError(
            f"configuration of {kind.__name__}{f' in {file}' if file else ''}: {explained(error, kind)}"
        ) from None
    except ValueError as error:
        raise ConfigError(
            f"configuration of {kind.__name__}{f' in {file}' if file else ''}: vehicle: {error}"
        ) from None
    return config


def _read(path: Path) -> dict[str, Any]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"cannot read the configuration {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"the configuration {path} is not text") from None
    try:
        loaded: dict[str, Any] = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except ValueError as error:
        kind = "JSON" if path.suffix == ".json" else "TOML"
        raise ConfigError(f"{path} is no valid {kind}: {error}") from None
    return loaded


def assign(raw: dict[str, Any], setting: str) -> None:
    """Put one `key=value` setting into place; dots descend, values are JSON or text. Raises ConfigError."""
    key, separator, text = setting.partition("=")
    if not separator:
        raise ConfigError(f"--set takes key=value, not {setting!r}")
    try:
        value: Any = json.loads(text)
    except ValueError:
        value = text
    *path, last = key.split(".")
    for part in path:
        raw = raw.setdefault(part, {})
        if not isinstance(raw, dict):
            raise ConfigError(f"--set {setting!r}: {part!r} was set to a value before, and has no {last!r}")
    raw[last] = value


NOT_SETTINGS = frozenset({"vehicle", "bus", "out_dir", "heartbeat_file", "log_level"})
"""Where a service runs, not how: these differ from drive to drive."""
MOST_TOLD = 2000


def changed_settings(config: ServiceConfig) -> str:
    """The settings that are not their defaults, as JSON of at most `MOST_TOLD` characters; empty: all are."""
    fields = [each for each in msgspec.structs.fields(config) if each.name not in NOT_SETTINGS]
    changed = {each.name: value for each in fields if (value := getattr(config, each.name)) != _default(each)}
    return msgspec.json.encode(changed).decode()[:MOST_TOLD] if changed else ""


def _default(field: msgspec.structs.FieldInfo) -> Any:
    return field.default_factory() if field.default_factory is not msgspec.NODEFAULT else field.default


def settings_of(pairs: Sequence[str]) -> dict[str, dict[str, Any]]:
    """`service.key=value` settings by service; further dots descend. Raises ConfigError."""
    found: dict[str, dict[str, Any]] = {}
    for pair in pairs:
        key, separator, _ = pair.partition("=")
        if not separator or "." not in key:
            raise ConfigError(f"--set takes service.key=value, not {pair!r}")
        assign(found, pair)
    return found
