"""The service table: each process, what it installs, serves and calls; supervision and access control read it."""

from collections.abc import Mapping
from types import MappingProxyType

import msgspec


class ServiceRow(msgspec.Struct, frozen=True, kw_only=True):
    """One service. Topics it may publish and read stand in the topic table."""

    name: str
    extra: str
    """The extra of the distribution that it needs; empty: none beyond the base."""
    tools: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()
    """Servers whose tools it may call; `*`: any, actuation excepted."""
    reads: tuple[str, ...] = ()
    """Names of topics that a third-party service reads; a built-in one stands in the topic table. Private topics do not count."""
    step_order: int = 50
    """Its place in a lockstep step."""
    start_order: int = 1
    memory_mb: int = 400
    module: str = ""


GATEWAYS = ("gateway", "gateway-stdio")
"""The service, and what `drivemcp mcp` joins as."""
RESERVED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "arbitrate": ("orchestrator",),
        "cited_paragraph": GATEWAYS,
        "citable_places": GATEWAYS,
        "decided_picture": GATEWAYS,
    }
)
"""Tools that only these services may call: part of the pipeline, or what the gateway makes resources and pictures of."""

SERVICES: tuple[ServiceRow, ...] = (
    ServiceRow(
        name="simulator",
        extra="simulator",
        tools=("start_scenario", "stop_scenario", "scenario_state"),
        step_order=0,
        start_order=3,
        memory_mb=900,
    ),
    ServiceRow(name="player", extra="player", step_order=0, start_order=3, memory_mb=400),
    ServiceRow(
        name="can",
        extra="can",
        tools=(
            "read_can_frames",
            "decode_can_frame",
            "filter_frames",
            "monitor_signal",
            "get_vehicle_snapshot",
            "send_obd_request",
            "send_diagnostic_request",
            "read_identifier",
            "read_unit_codes",
            "activate_fault_scenario",
            "read_dtcs",
            "explain_dtc",
            "vehicle_health",
            "clear_dtcs",
            "reset_ecu",
            "decode_j1939_frame",
            "list_j1939_pgns",
            "request_j1939_pgn",
            "read_j1939_dtcs",
            "step_recording",
            "read_vin",
            "uds_read_data",
            "uds_read_dtcs",
            "uds_clear_dtcs",
            "get_transmit_log",
            "list_can_logs",
            "analyze_can_log",
            "get_log_signal",
        ),
        step_order=10,
    ),
    ServiceRow(name="weather", extra="weather", tools=("assess_weather",), step_order=20),
    ServiceRow(name="perception", extra="perception", tools=("list_tracks",), step_order=30, memory_mb=600),
    ServiceRow(
        name="drivelm",
        extra="drivelm",
        tools=("ask_scene", "describe_scene", "decided_picture"),
        step_order=40,
        memory_mb=700,
    ),
    ServiceRow(name="retrieval", extra="retrieval", tools=("retrieve",), step_order=45, memory_mb=900),
    ServiceRow(
        name="rules",
        extra="rules",
        tools=(
            "lookup_rule",
            "interpret_sign",
            "applicable_limit",
            "right_of_way",
            "list_rulepacks",
            "cited_paragraph",
            "citable_places",
        ),
        calls=("retrieval",),
        step_order=46,
    ),
    ServiceRow(name="arbiter", extra="arbiter", tools=("arbitrate", "explain_decision"), step_order=50),
    ServiceRow(
        name="orchestrator",
        extra="orchestrator",
        tools=("ask", "feedback", "set_preferences", "acknowledge"),
        calls=("*",),
        step_order=60,
        start_order=2,
    ),
    ServiceRow(
        name="logger",
        extra="logger",
        tools=("recall", "remember", "find_traces"),
        step_order=70,
        start_order=0,
        memory_mb=700,
    ),
    ServiceRow(name="gateway", extra="gateway", calls=("*",), step_order=80, start_order=2),
    ServiceRow(name="cockpit", extra="cockpit", calls=("orchestrator",), step_order=90, start_order=2),
)
BY_NAME = {row.name: row for row in SERVICES}
OWNERS: Mapping[str, str] = MappingProxyType({tool: row.name for row in SERVICES for tool in row.tools})
"""The service that alone may offer each tool of the table."""
