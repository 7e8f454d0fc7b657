"""The row by which supervision and access control know the roadworks expert."""

from proto.services import ServiceRow

ROW = ServiceRow(
    name="roadworks",
    extra="",
    tools=("assess_roadworks",),
    reads=("drivelm/facts", "can/ego"),
    step_order=47,
    module="drivemcp_roadworks",
)
