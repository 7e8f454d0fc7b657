"""Writes a new expert: a distribution of its own with one tool, its row for supervision and access control, and a test."""

import keyword
import re
import sys
from pathlib import Path
from string import Template

from drivemcp.errors import UserError
from drivemcp.registry import service_rows

_FILES = {
    "pyproject.toml": """[build-system]
requires = ["hatchling>=1.25"]
build-backend = "hatchling.build"

[project]
name = "drivemcp-$name"
version = "0.1.0"
description = "A DriveMCP expert: $name"
requires-python = ">=3.11"
dependencies = ["drivemcp"]

[project.entry-points."drivemcp.services"]
$name = "$package.row:ROW"

[tool.hatch.build.targets.wheel]
packages = ["$package"]
""",
    "$package/__init__.py": '"""The $name expert."""\n',
    "$package/__main__.py": """from $package.service import SERVICE

from drivemcp.service import main

main(SERVICE)
""",
    "$package/row.py": '''"""The row by which supervision and access control know the $name expert."""

from proto.services import ServiceRow

ROW = ServiceRow(name="$name", extra="", tools=("assess_$name",), module="$package")
''',
    "$package/advice.py": '''"""What the $name expert knows. Pure: values in, values out."""

import msgspec


class Advice(msgspec.Struct, frozen=True, kw_only=True):
    """A speed factor in (0, 1] that can only lower the target, why, and how sure."""

    speed_factor: float
    reason: str
    confidence: float


def advise(rain_mm_h: float | None) -> Advice:
    """Replace this rule by yours. Unknown rain counts as some: less information is never less careful."""
    if rain_mm_h is None or rain_mm_h > 2.0:
        return Advice(speed_factor=0.9, reason="$name: slower in rain, or while rain is unknown", confidence=0.8)
    return Advice(speed_factor=1.0, reason="", confidence=0.8)
''',
    "$package/service.py": '''"""Binds the $name expert to the bus; decides nothing."""

from typing import Annotated

import msgspec
from $package.advice import Advice, advise

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from proto.tools import Effect

Rain = Annotated[float, msgspec.Meta(ge=0.0, description="rain, mm/h", examples=[4.0])]


def build(config: ServiceConfig, node: Node) -> None:
    """Offer the tool. `answers` names the events that route to it, `effect` the fields that may lower the target."""

    @node.tool(
        deadline_ms=30,
        answers=("low_friction", "speed_limit_change"),
        effect=Effect(speed_factor_field="speed_factor", text_field="reason"),
    )
    def assess_$name(rain_mm_h: Rain | None = None) -> Advice:
        """How much slower to drive, in the eyes of the $name expert."""
        return advise(rain_mm_h)


SERVICE = Service("$name", ServiceConfig, build)
''',
    "tests/test_$name.py": '''"""The $name expert on a real in-process bus."""

from $package.advice import advise
from $package.service import SERVICE

from drivemcp.testing import bus


def test_the_tool_answers_on_the_bus() -> None:
    with bus() as b:
        b.start(SERVICE)
        outcome = b.call("assess_$name", {"rain_mm_h": 5.0})
        assert outcome.ok, outcome.error
        assert outcome.result is not None
        assert 0 < outcome.result["speed_factor"] <= 1


def test_unknown_rain_is_never_less_careful_than_known_dry() -> None:
    assert advise(None).speed_factor <= advise(0.0).speed_factor
''',
}


def write_expert(name: str, into: Path) -> Path:
    """Write the expert's folder. Raises UserError on a name that cannot be one, is taken, or a folder that exists."""
    if not re.fullmatch(r"[a-z][a-z0-9_]{1,30}", name):
        raise UserError(f"{name!r} is no name for an expert: lower-case letters, digits and _, starting with a letter")
    if keyword.iskeyword(name) or name in sys.stdlib_module_names:
        raise UserError(f"{name!r} means something to Python; take another name")
    rows = service_rows()
    if name in rows:
        raise UserError(f"a service {name!r} exists already; take another name")
    folder = into / name
    if folder.exists():
        raise UserError(f"{folder} exists already; nothing was written")
    words = {"name": name, "package": f"drivemcp_{name}"}
    try:
        for pattern, text in _FILES.items():
            path = folder / Template(pattern).substitute(words)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(Template(text).substitute(words), encoding="utf-8")
    except OSError as error:
        raise UserError(f"cannot write into {into}: {error.strerror}") from None
    return folder
