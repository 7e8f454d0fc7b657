"""Binds the roadworks expert to the bus; decides nothing."""

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp_roadworks.advice import Advice, Seen, advise, drive, notice
from proto import topics
from proto.scene import Facts
from proto.tools import Effect

PERIOD_S = 0.2


class Zone:
    """The sign seen last; replaced whole, so that the tool's threads read one state."""

    def __init__(self, node: Node) -> None:
        self.seen: Seen | None = None
        self._node = node

    def look(self, facts: Facts) -> None:
        """New facts of the front end."""
        self.seen = notice(self.seen, facts.facts)

    def move(self) -> None:
        """The car moves on."""
        ego = self._node.latest(topics.EGO)
        self.seen = drive(self.seen, ego.message.speed_mps if ego else None, PERIOD_S)


def build(config: ServiceConfig, node: Node) -> None:
    """Follow signs and speed, and offer the tool."""
    zone = Zone(node)
    node.subscribe(topics.EGO)
    node.subscribe(topics.FACTS, lambda facts, _: zone.look(facts))
    node.every(PERIOD_S, zone.move)

    @node.tool(
        deadline_ms=30,
        answers=("speed_limit_change", "uncertain_sign", "low_friction", "overspeed", "closing_lead"),
        effect=Effect(speed_factor_field="speed_factor", headway_factor_field="headway_factor", text_field="reason"),
    )
    def assess_roadworks() -> Advice:
        """How much slower and further apart to drive because of roadworks here."""
        return advise(zone.seen)


SERVICE = Service("roadworks", ServiceConfig, build)
