"""The tools that ask the control units. Reading is `diagnostic`; what changes the car is `actuation`: the node refuses
it without a grant and the confirmation of exactly that call, and `requests` unless the car stands.
"""

from typing import Annotated

import msgspec

from drivemcp.node import Node
from services.can.diagnostics import uds
from services.can.tools import requests
from services.can.tools.replies import DiagnosticAnswer, FaultAnswer, ObdAnswer, UnitReport
from services.can.tools.requests import ClearBy, Reset
from services.can.vehicle import Vehicle

DEADLINE_MS = 14_000.0
"""The longest wait for the line, for a unit that asks for patience (8 s), and a second."""

Timeout = Annotated[
    float, msgspec.Meta(gt=0.0, le=5.0, description="longest wait for a first answer, s", examples=[2.0])
]
Unit = Annotated[
    str | None, msgspec.Meta(description="a unit's name in the vehicle profile; without: all", examples=["engine"])
]
OneUnit = Annotated[str, msgspec.Meta(description="a unit's name in the vehicle profile", examples=["engine"])]
Byte = Annotated[int, msgspec.Meta(ge=0, le=0xFF)]
Pids = Annotated[
    list[Byte], msgspec.Meta(max_length=6, description="several parameter numbers of service 1", examples=[[12, 13]])
]
Identifier = Annotated[
    int, msgspec.Meta(ge=0, le=0xFFFF, description="identifier, a number of 16 bits", examples=[0xF40C])
]
ObdService = Annotated[int, msgspec.Meta(description="OBD service number: 1, 2, 3, 7, 9 or 10", examples=[1])]
Pid = Annotated[int | None, msgspec.Meta(description="parameter number of services 1, 2 and 9", examples=[12])]
Freeze = Annotated[int, msgspec.Meta(ge=0, le=0xFF, description="number of the freeze frame, service 2", examples=[0])]
UdsService = Annotated[int, msgspec.Meta(description="ISO 14229 service number", examples=[0x22])]
Parameter = Annotated[int, msgspec.Meta(description="identifier or subfunction, a number", examples=[0xF40C])]
Field = Annotated[int, msgspec.Meta(description="the byte after it, a number", examples=[255])]
Kind = Annotated[uds.Report, msgspec.Meta(description="which report")]
Mask = Annotated[int, msgspec.Meta(ge=0, le=0xFF, description="status bits asked for, a number", examples=[8])]
Code = Annotated[str, msgspec.Meta(description="trouble code, for snapshot and extended", examples=["P030100"])]
Record = Annotated[int, msgspec.Meta(ge=0, le=0xFF, description="number of the record kept", examples=[1])]
By = Annotated[ClearBy, msgspec.Meta(description="by OBD service 4 or UDS service 0x14")]
How = Annotated[Reset, msgspec.Meta(description="how it restarts")]
Preset = Annotated[str | None, msgspec.Meta(description="the fault; none ends all", examples=["low_tyre"])]


def offer(node: Node, vehicle: Vehicle, *, fault_scenarios: bool) -> None:
    """Add them to the node."""
    _offer_obd(node, vehicle)
    _offer_uds(node, vehicle)
    _offer_actuation(node, vehicle)

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=False)
    def activate_fault_scenario(preset: Preset = None, timeout_s: Timeout = 2.0) -> FaultAnswer:
        """Give the simulated car a fault (abs_fault, low_tyre, fuel_cap_loose, ...), or end all (none). Refused unless
        configured.
        """
        return requests.activate_fault(vehicle, preset, timeout_s, allowed=fault_scenarios)


def _offer_obd(node: Node, vehicle: Vehicle) -> None:
    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def send_obd_request(
        service: ObdService,
        pid: Pid = None,
        timeout_s: Timeout = 2.0,
        pids: Pids | None = None,
        frame: Freeze = 0,
        ecu: Unit = None,
    ) -> ObdAnswer:
        """Ask the control units by OBD-II (SAE J1979): 1 now, 2 freeze frame, 3, 7 and 10 trouble codes, 9 about the
        car. Reading services only; every unit's answer, matched by id, service and parameter.
        """
        return requests.send_obd(vehicle, service, pid, timeout_s, pids=tuple(pids or ()), frame=frame, ecu=ecu)

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def send_diagnostic_request(
        service_id: UdsService,
        parameter_id: Parameter = 0,
        data_field: Field = 0,
        timeout_s: Timeout = 2.0,
        ecu: Unit = None,
    ) -> DiagnosticAnswer:
        """Ask control units by ISO 14229, answered in numbers: 0x22 reads an identifier, 0x19 trouble codes, 0x3E asks
        who is there.
        """
        return requests.send_diagnostic(vehicle, service_id, parameter_id, data_field, timeout_s, ecu)


def _offer_uds(node: Node, vehicle: Vehicle) -> None:
    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def read_identifier(identifier: Identifier, ecu: Unit = None, timeout_s: Timeout = 2.0) -> UnitReport:
        """Read one identifier (ISO 14229 service 0x22) in words: 0xF4xx is parameter xx of OBD service 1."""
        return requests.read_units(vehicle, lambda: uds.identifier_request(identifier), ecu, timeout_s)

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def read_unit_codes(
        report: Kind = "by_status",
        ecu: Unit = None,
        status_mask: Mask = 0xFF,
        code: Code = "",
        record: Record = 1,
        timeout_s: Timeout = 2.0,
    ) -> UnitReport:
        """Trouble codes with their status (ISO 14229 service 0x19): by status mask, all that are supported, or for one
        code the snapshot or the extended data kept with it.
        """
        return requests.read_units(
            vehicle, lambda: uds.codes_request(report, status_mask, code, record), ecu, timeout_s
        )


def _offer_actuation(node: Node, vehicle: Vehicle) -> None:
    @node.tool(deadline_ms=DEADLINE_MS, capability="actuation", idempotent=False)
    def clear_dtcs(timeout_s: Timeout = 2.0, by: By = "obd", ecu: Unit = None) -> DiagnosticAnswer:
        """Clear the trouble codes, by OBD service 4 or UDS service 0x14. Takes a grant and a confirmation of exactly this
        command; the car must stand.
        """
        return requests.clear_codes(vehicle, by, ecu, timeout_s, now_ns=node.clock.now_ns())

    @node.tool(deadline_ms=DEADLINE_MS, capability="actuation", idempotent=False)
    def reset_ecu(ecu: OneUnit, kind: How = "soft", timeout_s: Timeout = 2.0) -> DiagnosticAnswer:
        """Restart one control unit (ISO 14229 service 0x11). Takes a grant and a confirmation of exactly this command; the
        car must stand.
        """
        return requests.reset_unit(vehicle, ecu, kind, timeout_s, now_ns=node.clock.now_ns())
