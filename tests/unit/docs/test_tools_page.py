"""The page that teaches tools, run."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from drivemcp.bus.access import access_control
from drivemcp.commands.scaffold import write_expert
from drivemcp.errors import UserError
from proto.decision import ArbitrationRequest, Decision
from proto.services import SERVICES, ServiceRow
from proto.speech import Memory
from services.arbiter.filters import Filter
from services.orchestrator.advisor import Tools
from services.orchestrator.observations.inputs import Method
from services.orchestrator.speech.local import decide_locally
from services.orchestrator.state import State
from services.simulator.scenario.load import load_scenario
from tests.unit.services.arbiter.support import fused, request

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "tutorial" / "your-first-tool.md"


def run_tests(folder: Path) -> subprocess.CompletedProcess[str]:
    """The expert's own tests, as its author runs them."""
    paths = os.pathsep.join([str(folder), str(ROOT)])
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(folder), "tests"]
    return subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_the_command_on_the_page_writes_an_expert_whose_own_tests_pass(tmp_path: Path) -> None:
    name = re.search(r"drivemcp tools new (\w+)", PAGE.read_text())
    assert name is not None
    folder = write_expert(name.group(1), tmp_path)
    ran = run_tests(folder)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_the_function_on_the_page_is_the_one_that_is_written(tmp_path: Path) -> None:
    page = PAGE.read_text()
    written = (write_expert("fog_horn", tmp_path) / "drivemcp_fog_horn" / "service.py").read_text()
    block = re.search(r"```python\n(@node.tool.*?)```", page, re.DOTALL)
    assert block is not None
    lines = [line.strip() for line in block.group(1).splitlines() if line.strip()]
    assert all(line in written for line in lines)


def test_advisor_and_filter_of_the_page_advise_and_filter() -> None:
    block = re.search(r"```python\n(class Local.*?)```", PAGE.read_text(), re.DOTALL)
    assert block is not None
    names: dict[str, Any] = {each.__name__: each for each in (ArbitrationRequest, Decision, Filter, Tools)}
    names |= {"decide_locally": decide_locally, "Ask": object, "State": State, "DecisionKind": str}
    exec(compile(block.group(1), str(PAGE), "exec"), names)
    advised = request(fused=fused(urgency="warning"))
    assert names["Local"](Method(name="local")).decide(advised, State(), None) == decide_locally(advised, Memory(), 0)
    assert isinstance(names["WARNINGS"], Filter)
    assert names["WARNINGS"].said(advised) == ("SPEAK", "a warning")
    assert names["WARNINGS"].said(request(fused=fused(urgency="info")))[0] == "SILENT"


def test_the_example_expert_passes_its_own_tests() -> None:
    ran = run_tests(ROOT / "examples" / "roadworks")
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_the_example_has_a_road_on_which_it_has_something_to_say() -> None:
    road = ROOT / "examples" / "roadworks" / "scenario.toml"
    assert str(road.relative_to(ROOT)) in PAGE.read_text()
    assert any("roadworks" in sign.codes for sign in load_scenario(road).signs)


@pytest.mark.parametrize("name", ["Rules", "rules", "../x", "", "a*b"])
def test_a_name_that_cannot_be_a_service_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(UserError):
        write_expert(name, tmp_path)


def test_a_third_party_row_gives_what_it_says_and_never_private_topics_or_the_truth() -> None:
    row = ServiceRow(
        name="roadworks",
        extra="",
        tools=("assess_roadworks",),
        reads=("drivelm/facts", "truth/state", "can/<id>/rx"),
        module="x",
    )
    rules = {rule["id"]: rule for rule in access_control([*SERVICES, row])["rules"]}
    assert "drivemcp/*/drivelm/facts" in rules["roadworks-receive"]["key_exprs"]
    assert not any("truth" in key or key.endswith("/rx") for key in rules["roadworks-receive"]["key_exprs"])
    assert "drivemcp/*/tool/roadworks/assess_roadworks" in rules["orchestrator-ask"]["key_exprs"]
    assert not any("actuation" in key for key in rules["roadworks-publish"]["key_exprs"])
