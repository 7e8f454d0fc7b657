"""Reading a scenario file, and saying plainly which field of it is wrong."""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec

from services.simulator.car.faults import check
from services.simulator.scenario.plan import FaultPlan, Scenario
from services.simulator.signart.catalogue import CODES

_PLACED = ("signs", "lights", "stops", "yields", "zebras", "gantries", "crossers", "vehicles")
Complaint = tuple[str, str]
"""A field, and what is wrong with it."""


class ScenarioError(ValueError):
    """A scenario file that cannot be driven; the text names file and field."""


def load_scenario(path: Path) -> Scenario:
    """Read and check a TOML or JSON file; raises ScenarioError."""
    try:
        text = path.read_bytes()
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from error
    return parse_scenario(text, str(path), "JSON" if path.suffix == ".json" else "TOML")


def parse_scenario(text: bytes | str, name: str, form: Literal["TOML", "JSON"] = "TOML") -> Scenario:
    """Check the text of a scenario; `name` stands in error messages."""
    decode = msgspec.json.decode if form == "JSON" else msgspec.toml.decode
    try:
        scenario = decode(text, type=Scenario)
    except msgspec.ValidationError as error:
        raise ScenarioError(f"{name}: {_plainly(str(error))}") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{name}: not {form}: {error}") from error
    for field, reason in complaints(scenario):
        raise ScenarioError(f"{name}: {field}: {reason}")
    return scenario


def read_fault(text: str) -> FaultPlan:
    """`PRESET@SECONDS` or `PRESET:SEVERITY@SECONDS`; SECONDS may be left out: from the start. Raises ValueError."""
    what, _, at_s = text.partition("@")
    preset, _, severity = what.partition(":")
    check(preset)
    try:
        return msgspec.convert(
            {"preset": preset, "at_s": float(at_s or 0.0), "severity": float(severity or 1.0)}, FaultPlan
        )
    except ValueError as error:
        raise ValueError(f"{text!r} is no fault: PRESET:SEVERITY@SECONDS, 0 < severity <= 1 ({error})") from error


def country_at(scenario: Scenario, s_m: float) -> str:
    """The jurisdiction in force at s: the last border passed."""
    country: str = scenario.country
    for at_m, entered in sorted(_borders(scenario)):
        if at_m <= s_m:
            country = entered
    return country


def _borders(scenario: Scenario) -> Iterator[tuple[float, str]]:
    for sign in scenario.signs:
        for code in sign.codes:
            if code.startswith("border:"):
                yield sign.at_m, code.removeprefix("border:")


def sign_country(scenario: Scenario, at_m: float, own: str | None) -> str:
    """In whose style a sign at s is drawn."""
    return own or country_at(scenario, at_m)


def _plainly(text: str) -> str:
    """`Expected ... - at `$.signs[0].at_m`` with the field first."""
    reason, mark, where = text.rpartition(" - at `$")
    if not mark:
        return text
    return f"{where.strip('`').lstrip('.') or 'the file'}: {reason}"


def complaints(scenario: Scenario) -> Iterator[Complaint]:
    """What cannot be driven, field by field."""
    yield from _outside(scenario)
    yield from _unknown_codes(scenario)
    yield from _order(scenario)
    yield from _lanes(scenario)
    yield from _faults(scenario)


def _outside(scenario: Scenario) -> Iterator[Complaint]:
    length = scenario.length_m
    for group in _PLACED:
        for index, item in enumerate(getattr(scenario, group)):
            if item.at_m > length:
                yield f"{group}[{index}].at_m", f"{item.at_m:g} m lies beyond the end of the route ({length:g} m)"
    if scenario.ego.at_m > length - 100:
        yield "ego.at_m", f"leaves less than 100 m of the route ({length:g} m)"
    for group in ("walkers", "water"):
        for index, item in enumerate(getattr(scenario, group)):
            if item.to_m < item.from_m:
                yield f"{group}[{index}].to_m", "lies before from_m"


def _unknown_codes(scenario: Scenario) -> Iterator[Complaint]:
    for index, sign in enumerate(scenario.signs):
        country = sign_country(scenario, sign.at_m, sign.country)
        for number, code in enumerate(sign.codes):
            if code not in CODES[country]:
                yield f"signs[{index}].codes[{number}]", f"{country} has no sign {code!r}"
    for index, gantry in enumerate(scenario.gantries):
        country = country_at(scenario, gantry.at_m)
        for number, step in enumerate(gantry.steps):
            for field, codes in (("code", (step.code,)), ("lanes", step.lanes)):
                for code in set(codes) - {"", *CODES[country]}:
                    yield f"gantries[{index}].steps[{number}].{field}", f"{country} has no panel {code!r}"


def _order(scenario: Scenario) -> Iterator[Complaint]:
    rising = {
        "weather": ("at_s", [key.at_s for key in scenario.weather]),
        "road.stretches": ("from_m", [stretch.from_m for stretch in scenario.road.stretches]),
    }
    for group, (field, values) in rising.items():
        if values[0] != 0:
            yield f"{group}[0].{field}", "the first must be 0"
        for index, (before, after) in enumerate(itertools.pairwise(values), start=1):
            if after <= before:
                yield f"{group}[{index}].{field}", f"{after:g} does not come after {before:g}"


def _faults(scenario: Scenario) -> Iterator[Complaint]:
    for index, fault in enumerate(scenario.faults):
        try:
            check(fault.preset)
        except ValueError as error:
            yield f"faults[{index}].preset", str(error)


def _lanes(scenario: Scenario) -> Iterator[Complaint]:
    if scenario.road.changeover_m is not None and scenario.road.lanes > 1:
        yield "road.changeover_m", "only a road with one lane in each direction can change sides"
    if scenario.ego.lane >= scenario.road.lanes:
        yield "ego.lane", f"there are only {scenario.road.lanes} lanes"
    for index, vehicle in enumerate(scenario.vehicles):
        lanes = (vehicle.lane, vehicle.lane_change.to_lane if vehicle.lane_change else 0)
        if max(lanes) >= scenario.road.lanes:
            yield f"vehicles[{index}].lane", f"there are only {scenario.road.lanes} lanes"
    for index, gantry in enumerate(scenario.gantries):
        for number, step in enumerate(gantry.steps):
            if step.lanes and (len(step.lanes) != scenario.road.lanes or step.lanes[scenario.ego.lane]):
                yield f"gantries[{index}].steps[{number}].lanes", 'one for each lane, "" over the ego\'s'
