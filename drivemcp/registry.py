"""Every service that can be run: the built-in table, and what other distributions register under `drivemcp.services`."""

import importlib
from functools import cache
from importlib.metadata import entry_points
from typing import Any

from drivemcp.errors import ConfigError, UserError
from drivemcp.service import Service
from proto.services import SERVICES, ServiceRow

GROUP = "drivemcp.services"


def service_rows() -> dict[str, ServiceRow]:
    """All rows by name. A third-party row never replaces a built-in one, nor takes one of its tool names."""
    rows = {row.name: row for row in SERVICES}
    tools = {tool for row in SERVICES for tool in row.tools}
    for point in entry_points(group=GROUP):
        row = point.load()
        if not isinstance(row, ServiceRow):
            raise UserError(f"{point.value} (entry point {GROUP}) is no proto.services.ServiceRow")
        if row.name in rows or tools & set(row.tools):
            raise UserError(f"service {row.name!r} of {point.value} takes a name that is in use")
        rows[row.name] = row
        tools |= set(row.tools)
    return rows


def module_of(row: ServiceRow) -> str:
    """The package of a service, runnable with `python -m`."""
    return row.module or f"services.{row.name}"


def load_service(name: str) -> "Service[object]":  # type: ignore[type-var]
    """Import a service. Raises UserError for an unknown name, or naming the extra that is not installed."""
    rows = service_rows()
    if name not in rows:
        raise UserError(f"no service {name!r}; there are: {', '.join(sorted(rows))}")
    row = rows[name]
    try:
        module = importlib.import_module(f"{module_of(row)}.service")
    except ModuleNotFoundError as error:
        extra = f"pip install 'drivemcp[{row.extra}]'" if row.extra else "the distribution that brings it"
        raise UserError(f"service {name!r} needs the module {error.name!r}: {extra}") from None
    service: Service[object] = module.SERVICE  # type: ignore[type-var]
    return service


@cache
def registered(group: str, name: str, setting: str) -> Any:
    """What an installed distribution registers under an entry-point group. Raises ConfigError naming the setting."""
    points = {point.name: point for point in entry_points(group=group)}
    if name not in points:
        raise ConfigError(
            f"{setting} = {name}: there is no such entry point in {group}; there are: {sorted(points)}. Those of the "
            "evaluation come with pip install 'drivemcp[evaluation]'"
        )
    try:
        return points[name].load()
    except ModuleNotFoundError as error:
        raise ConfigError(f"{setting} = {name} needs the package {error.name!r}, which is not installed") from None
