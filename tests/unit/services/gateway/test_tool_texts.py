"""Every tool's text as a language model reads it: described, with unit and example, short enough, and one shape of refusal."""

import json
import re
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from mcp import types

from drivemcp.node import Node
from drivemcp.testing import TestBus, bus
from drivemcp.tools.definition import Tool
from services.gateway.tool_list import as_tool, offered
from tests.unit.services.gateway.whole import start_all

MOST_BYTES = 40_000
UNITS = {
    "_mps": "m/s",
    "_mm_h": "mm/h",
    "_mm": "mm",
    "_ns": "ns",
    "_c": "degC",
    "_m": "m",
    "_s": "s",
    "_h": "h",
    "_t": "t",
}
NUMBERED = re.compile(r"\b(unit|number|probability|stage|" + "|".join(UNITS.values()) + r")\b")
SHAPE = re.compile(r"^.+ \[field: .+\] \[do: .+\]$", re.DOTALL)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestBus, list[Node]]]:
    """All services that offer tools."""
    with bus() as b:
        yield b, start_all(b, tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def tools(whole: tuple[TestBus, list[Node]]) -> dict[str, Tool]:
    """All tools that a client is offered, by name."""
    return {tool.entry.name: tool for node in whole[1] for tool in node.tools.tools if not tool.entry.meta.callers}


@pytest.fixture(scope="module")
def listed(tools: dict[str, Tool]) -> dict[str, Any]:
    """`tools/list` as it goes over the wire."""
    entries = offered({name: tool.entry for name, tool in tools.items()})
    result = types.ListToolsResult(tools=[as_tool(entry) for entry in entries.values()])
    dumped: dict[str, Any] = result.model_dump(mode="json", by_alias=True, exclude_none=True)
    return dumped


def parameters(schema: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every parameter, those within objects and arrays too."""
    for name, each in schema.get("properties", {}).items():
        yield f"{path}.{name}".lstrip("."), each
        for inner in (each, each.get("items", {})):
            yield from parameters(inner, f"{path}.{name}".lstrip("."))


def test_the_whole_list_is_at_most_40_kilobytes(listed: dict[str, Any]) -> None:
    size = len(json.dumps(listed, separators=(",", ":"), ensure_ascii=False).encode())
    assert len(listed["tools"]) >= 40
    assert size <= MOST_BYTES, f"{size} bytes"


def test_every_parameter_of_every_tool_is_described_with_unit_and_example(listed: dict[str, Any]) -> None:
    wanting = []
    for tool in listed["tools"]:
        assert tool["description"], tool["name"]
        for path, schema in parameters(tool["inputSchema"]):
            where, said = f"{tool['name']}.{path}", schema.get("description", "")
            kinds = {schema.get("type"), *(each.get("type") for each in schema.get("anyOf", ()))}
            closed = "enum" in schema or any("enum" in each for each in schema.get("anyOf", ()))
            if not said:
                wanting.append(f"{where}: no description")
            if kinds & {"number", "integer"} and not NUMBERED.search(said):
                wanting.append(f"{where}: no unit in {said!r}")
            unit = next((unit for suffix, unit in UNITS.items() if path.endswith(suffix)), "")
            if unit and not re.search(rf"(^|[ (]){re.escape(unit)}([;,)]|$| )", said):
                wanting.append(f"{where}: no {unit} in {said!r}")
            of_objects = "properties" in schema or "properties" in schema.get("items", {})
            if not (closed or "boolean" in kinds or of_objects or schema.get("examples")):
                wanting.append(f"{where}: no example")
    assert wanting == []


def test_no_parameter_is_a_reference(listed: dict[str, Any]) -> None:
    assert "$ref" not in json.dumps([tool["inputSchema"] for tool in listed["tools"]])


def test_every_example_is_taken(tools: dict[str, Tool]) -> None:
    tried = 0
    for tool in tools.values():
        kinds = {field.encode_name: field.type for field in msgspec.structs.fields(tool.arguments)}
        for name, schema in tool.entry.inputSchema.get("properties", {}).items():
            for example in schema.get("examples", ()):
                msgspec.convert(example, kinds[name])
                tried += 1
    assert tried > 60


def test_every_tool_refuses_in_the_one_shape_and_names_the_field(
    whole: tuple[TestBus, list[Node]], tools: dict[str, Tool]
) -> None:
    for name in tools:
        error = whole[0].call(name, {"no_such_field": 1}).error
        assert SHAPE.match(error), error
        assert "[field: no_such_field]" in error or tools[name].entry.meta.capability == "actuation", error


@pytest.mark.parametrize(
    ("tool", "arguments", "field", "do"),
    [
        ("applicable_limit", {"situation": {"raod_type": "urban"}}, "situation.raod_type", 'write "road_type"'),
        ("applicable_limit", {"situation": {"posted": [{"value": 5, "unit": "mph", "plate": []}]}},
         "situation.posted[0].plate", 'write "plates"'),
        ("applicable_limit", {"situation": {"visibility_m": -1}}, "situation.visibility_m", "how far one sees, m, for example 150.0"),
        ("applicable_limit", {"situation": {"time_of_day_h": 25}}, "situation.time_of_day_h", "local time, h"),
        ("applicable_limit", {}, "situation", "give"),
        ("assess_weather", {"rain_mm_h": -2.0}, "rain_mm_h", "give rain, mm/h, for example 4.0"),
        ("assess_weather", {"wiper_stage": 2.5}, "wiper_stage", "give wiper stage, 0 to 3"),
        ("assess_weather", {"rain": 2.0}, "rain", 'write "rain_mm_h"'),
        ("monitor_signal", {"signal_name": "vehicle speed"}, "signal_name", "write one of VehicleSpeed"),
        ("filter_frames", {"signal_name": "enginespeed"}, "signal_name", "write one of EngineSpeed"),
        ("monitor_signal", {"signal_name": "???"}, "signal_name", "get_vehicle_snapshot"),
        ("start_scenario", {"scenario": "urb-rian"}, "scenario", "name a shipped scenario"),
        ("explain_decision", {"tick": 7}, "tick", "for the last"),
        ("recall", {"kind": "notes"}, "kind", '"note"'),
    ],
)  # fmt: skip
def test_a_refusal_says_which_field_and_what_to_do(
    whole: tuple[TestBus, list[Node]], tool: str, arguments: dict[str, Any], field: str, do: str
) -> None:
    outcome = whole[0].call(tool, arguments)
    assert outcome.status == "tool_error", outcome
    assert f"[field: {field}]" in outcome.error
    assert do in outcome.error.partition("[do: ")[2]


def test_a_name_that_no_tool_has_is_answered_with_the_nearest(whole: tuple[TestBus, list[Node]]) -> None:
    error = whole[0].call("aplicable_limit", {}).error
    assert SHAPE.match(error)
    assert 'write "applicable_limit"' in error


def test_a_whole_number_written_as_a_float_is_an_integer(whole: tuple[TestBus, list[Node]]) -> None:
    outcome = whole[0].call("find_traces", {"limit": 3.0, "after_ns": 0.0})
    assert outcome.ok, outcome.error
