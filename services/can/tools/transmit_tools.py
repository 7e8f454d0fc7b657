"""The tool that shows what may leave on a bus and what did."""

from collections.abc import Mapping
from typing import Annotated

import msgspec

from drivemcp.errors import ToolFailed
from drivemcp.node import Node
from services.can.buses.guarded import RECORDS_LIMIT, GuardedLink, TransmitPolicy, TransmitRecord

Limit = Annotated[int, msgspec.Meta(ge=1, le=RECORDS_LIMIT, description="number of newest frames", examples=[20])]
BusName = Annotated[
    str,
    msgspec.Meta(
        max_length=64, description="a bus of the car; empty: where control units are asked", examples=["can0"]
    ),
]


class TransmitLog(msgspec.Struct, frozen=True, kw_only=True):
    """The policy in force on a bus, and the last frames that were sent on it or held back, oldest first."""

    policy: TransmitPolicy
    records: tuple[TransmitRecord, ...]


def offer(node: Node, links: Mapping[str, GuardedLink], asked: str) -> None:
    """Add it to the node. `asked`: the bus on which control units are asked."""

    @node.tool(deadline_ms=40)
    def get_transmit_log(limit: Limit = 20, bus: BusName = "") -> TransmitLog:
        """What may be sent on a bus (whether, on which ids, services that change the car), and the last frames sent or
        held back with the reason, flow control of long answers too. Sends nothing.
        """
        name = bus or asked
        if name not in links:
            raise ToolFailed(f"bus: there is no bus {name[:40]!r}; there are {', '.join(links)}")
        return TransmitLog(policy=links[name].policy, records=links[name].records(limit))
