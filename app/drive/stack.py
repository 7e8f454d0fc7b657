"""The stack of one drive: router and services as processes on loopback with free ports and a vehicle name of its own."""

import os
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

import msgspec

from drivemcp.bus.session import Bus, open_bus
from drivemcp.client import RunningStack, forget_stack, note_stack
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.errors import BusError, UserError
from drivemcp.node import Node
from drivemcp.registry import module_of, service_rows
from drivemcp.runtime.supervisor import Child, Supervisor, free_port
from proto.services import ServiceRow

READY_S = 60.0
FIRST = "logger"
"""Alive before the others speak, ended after them: the log holds the first tick and the last."""
SOURCES = ("simulator", "player")


class StackPlan(msgspec.Struct, frozen=True, kw_only=True):
    """What to start. `source` brings the sensors: the simulator or the player of recordings."""

    folder: str
    source: str = "simulator"
    settings: dict[str, dict[str, Any]] = {}
    """Settings by service."""
    common: dict[str, Any] = {}
    """Settings for every service."""
    without: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    """Third-party services to start as well."""
    vehicle: str = ""
    port: int = 0
    hosts: dict[str, tuple[str, ...]] = {}
    """By service: the module, and its first arguments, that is run in place of the service's own and hosts it."""


class Stack:
    """Started by `with`; ended, whatever happens, at its end. `interrupted` ends the waits of its start: KeyboardInterrupt."""

    def __init__(self, plan: StackPlan, say: Callable[[str], None], interrupted: threading.Event | None = None) -> None:
        self._plan = plan
        self._interrupted = interrupted or threading.Event()
        self._say = say
        self.vehicle = plan.vehicle or f"car-{secrets.token_hex(3)}"
        self.endpoint = f"tcp/127.0.0.1:{plan.port or free_port()}"
        self.folder = Path(plan.folder).resolve()
        self.supervisor = Supervisor(self.folder, say, self._interrupted)
        self._bus_config = BusConfig(connect=(self.endpoint,))
        self._session: Bus | None = None
        self.node: Node | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def rows(self) -> list[ServiceRow]:
        """The services of this plan, in the order in which they start; the source last."""
        table = service_rows()
        unknown = [name for name in self._plan.extra if name not in table]
        if unknown:
            raise UserError(f"no service {unknown[0]!r} is installed; pip install its distribution first")
        builtin = {name for name, row in table.items() if not row.module}
        other_sources = set(SOURCES) - {self._plan.source}
        chosen = (builtin | set(self._plan.extra)) - set(self._plan.without) - other_sources
        return sorted(
            (table[name] for name in chosen), key=lambda row: (row.name == self._plan.source, row.start_order)
        )

    def start(self) -> Node:
        """Router, then services; returns a node on the bus once all but the source are alive, and starts the source."""
        rows = self.rows()
        self.supervisor.run("router", "drivemcp.bus.router", ["--listen", self.endpoint])
        node = self._join()
        self._begin(node, [row for row in rows if row.name == FIRST])
        self._begin(node, [row for row in rows if row.name not in (FIRST, self._plan.source)])
        for row in rows:
            if row.name == self._plan.source:
                self._run(row)
        note_stack(RunningStack(endpoint=self.endpoint, vehicle=self.vehicle, folder=str(self.folder), pid=os.getpid()))
        return node

    def _begin(self, node: Node, rows: list[ServiceRow]) -> None:
        for row in rows:
            self._run(row)
        self._wait_alive(node, {row.name for row in rows})

    def wait_for_source(self) -> None:
        """Wait until the simulator or player is alive."""
        assert self.node is not None
        self._wait_alive(self.node, {self._plan.source})

    def child(self, name: str) -> Child:
        """One process."""
        return self.supervisor.child(name)

    def restarts(self) -> dict[str, int]:
        """How often each process that ended was started again."""
        return {child.name: child.restarts for child in self.supervisor.children if child.restarts}

    def close(self) -> None:
        """End everything."""
        forget_stack(os.getpid())
        if self.node is not None:
            self.node.close()
        if self._session is not None:
            self._session.close()
        self.supervisor.stop(last=(FIRST, "router"))

    def _join(self) -> Node:
        deadline_s = time.monotonic() + 15.0
        while self._session is None:
            if self._interrupted.is_set():
                raise KeyboardInterrupt
            try:
                self._session = open_bus(msgspec.structs.replace(self._bus_config, connect_timeout_s=2.0))
            except BusError:
                if time.monotonic() > deadline_s:
                    raise UserError(f"the router did not come up:\n{self.child('router').log_tail()}") from None
        self.node = Node(self._session, "evaluation", ServiceConfig(vehicle=self.vehicle, bus=self._bus_config))
        self.node.watch_services()
        self.node.open(announce=False)
        return self.node

    def _run(self, row: ServiceRow) -> None:
        module, *before = self._plan.hosts.get(row.name, (module_of(row),))
        self.supervisor.run_service(row.name, module, self._config(row), before)

    def _config(self, row: ServiceRow) -> Mapping[str, Any]:
        return {
            "vehicle": self.vehicle,
            "bus": {"mode": "client", "connect": [self.endpoint]},
            "out_dir": str(self.folder),
            **self._plan.common,
            **self._plan.settings.get(row.name, {}),
        }

    def _wait_alive(self, node: Node, wanted: set[str]) -> None:
        said: set[str] = set()

        def ready() -> bool:
            alive = node.alive_services() & wanted
            for name in sorted(alive - said):
                said.add(name)
                self._say(f"{name} is up")
            return alive == wanted

        self.supervisor.wait_until(ready, f"{', '.join(sorted(wanted)) if len(wanted) < 3 else 'the stack'}", READY_S)


def folder_for(name: str, root: str = "out") -> str:
    """A new folder for one drive: `out/<time>-<name>`."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    path = Path(root) / f"{stamp}-{name}"
    number = 1
    while path.exists():
        number += 1
        path = Path(root) / f"{stamp}-{name}-{number}"
    try:
        path.mkdir(parents=True)
    except OSError as error:
        raise UserError(f"cannot make the folder {path}: {error.strerror}") from None
    return str(path)
