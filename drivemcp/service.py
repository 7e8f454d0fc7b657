"""The runner: reads the configuration, opens the bus, builds the service, lives until SIGTERM, closes in order."""

import argparse
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import msgspec

from drivemcp.bus.session import Bus, open_bus
from drivemcp.config import ServiceConfig, changed_settings, load_config
from drivemcp.errors import BusError, DriveMcpError, UserError
from drivemcp.files.modes import deny_others
from drivemcp.node import Node
from drivemcp.runtime.logs import set_up_logging
from drivemcp.runtime.parent import end_with_parent
from drivemcp.runtime.proto_guard import check_proto
from drivemcp.tools.definition import Tool
from drivemcp.tools.server import Authorize
from proto.tools import CallHead

if TYPE_CHECKING:
    from drivemcp.runtime.authorizing import CallAuthorizer

C = TypeVar("C", bound=ServiceConfig)


class Service(Generic[C]):
    """What a service is: its name, the type of its configuration, and the function that wires it to a node."""

    def __init__(self, name: str, config: type[C], build: Callable[[C, Node], None]) -> None:
        self.name = name
        self.config = config
        self.build = build

    def start(self, bus: Bus, config: C, *, authorize: Authorize | None = None) -> Node:
        """Build on a bus and announce. A failure closes what was begun and is passed on."""
        node = Node(bus, self.name, config, authorize=authorize or authorize_by_grant(config))
        if told := changed_settings(config):
            node.detail["settings"] = told
        try:
            self.build(config, node)
            node.open()
        except BaseException:
            node.close()
            raise
        return node


def authorize_by_grant(config: ServiceConfig) -> Authorize:
    """Actuation tools need a grant that names vehicle and tool, and the confirmation of exactly that command."""
    if not config.trusted_keys and not config.trusted_keys_file:
        return lambda tool, head, payload: (
            "actuation is off; it takes a grant (drivemcp grant) and a confirmation of this very command"
        )
    made: list[CallAuthorizer] = []
    lock = threading.Lock()

    def authorize(tool: Tool, head: CallHead, payload: bytes) -> str:
        from drivemcp.runtime.authorizing import CallAuthorizer  # cryptography is loaded where actuation is asked for

        with lock:
            if not made:
                made.append(CallAuthorizer(config.vehicle, config.trusted_keys, config.trusted_keys_file))
        return made[0].why_refused(tool.entry.name, head, payload)

    return authorize


def parser_for(service: Service[Any]) -> argparse.ArgumentParser:
    """The flags of one service."""
    parser = argparse.ArgumentParser(prog=f"drivemcp run {service.name}", description=f"The {service.name} service.")
    parser.add_argument("--config", metavar="FILE", help="TOML or JSON file with the service's settings")
    parser.add_argument("--connect", metavar="ENDPOINT", action="append", help="router, for example tcp/127.0.0.1:7447")
    parser.add_argument("--vehicle", metavar="NAME", help="name of the vehicle on the bus")
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="one setting; dots descend")
    parser.add_argument("--show-config", action="store_true", help="print the settings in force and end")
    return parser


def main(service: Service[Any], arguments: Sequence[str] | None = None) -> None:
    """Run a service as a process, and exit: 0 after SIGTERM or SIGINT, 2 on a user's mistake, 1 when it broke."""
    status = run(service, arguments)
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # a tool that hangs must not keep, nor crash, an interpreter that ends


def run(service: Service[Any], arguments: Sequence[str] | None = None) -> int:
    """As `main`, returning the exit status."""
    flags = parser_for(service).parse_args(arguments)
    try:
        check_proto()
        settings = list(flags.set)
        if flags.connect:
            settings.append(f"bus.connect={msgspec.json.encode(flags.connect).decode()}")
        config = load_config(service.config, flags.config, settings, vehicle=flags.vehicle)
        if flags.show_config:
            sys.stdout.write(msgspec.json.format(msgspec.json.encode(config)).decode() + "\n")
            return 0
        return _live(service, config)
    except (UserError, BusError) as error:
        sys.stderr.write(f"drivemcp run {service.name}: {error}\n")
        return 2
    except DriveMcpError:
        logging.getLogger("drivemcp").exception("%s ends", service.name)
        return 1


def _live(service: Service[Any], config: ServiceConfig) -> int:
    deny_others()
    set_up_logging(service.name, config.log_level)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    end_with_parent()
    with open_bus(config.bus) as bus:
        node = service.start(bus, config)
        node.log.info("ready", extra={"fields": {"vehicle": config.vehicle}})
        try:
            stop.wait()
        finally:
            node.close()
    return 0
