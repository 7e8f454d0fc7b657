"""All services that offer tools, on one in-process bus; nothing moves, and no scenario runs."""

from pathlib import Path

from drivemcp.node import Node
from drivemcp.registry import load_service
from drivemcp.testing import TestBus
from proto.services import SERVICES
from services.logger.service import LoggerConfig
from services.simulator.service import SimulatorConfig


def start_all(b: TestBus, folder: Path) -> list[Node]:
    """Their nodes."""
    configs = {
        "logger": LoggerConfig(out_dir=str(folder), secret_dir=str(folder / "secrets")),
        "simulator": SimulatorConfig(autostart=False),
    }
    return [b.start(load_service(row.name), configs.get(row.name)) for row in SERVICES if row.tools]
