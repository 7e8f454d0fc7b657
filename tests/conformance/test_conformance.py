"""The official conformance suite against the real gateway, with the suite's own fixture beside the gateway's tools."""

import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drivemcp.testing import bus
from services.gateway import service
from services.gateway.server import GatewayServer, make_server
from services.gateway.service import SERVICE
from tests.conformance.fixture import Fixture

ROOT = Path(__file__).parents[2]
PROGRAMS = ROOT / ".conformance" / "node_modules" / ".bin"
LEAST = {"2025-06-18": 50, "2025-11-25": 75, "2026-07-28": 145}
"""Checks that pass, so that a suite which runs none does not pass."""
EXPECTED = Path(__file__).parent / "expected-failures.yml"

pytestmark = pytest.mark.skipif(
    not (PROGRAMS / "conformance").exists(), reason="the suite is not installed: `make conformance` does, with npm"
)


@pytest.fixture
def url(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Of a gateway with the fixture."""

    def with_fixture(node: Any, changes: Any, *others: Any, **options: Any) -> GatewayServer:
        server = make_server(node, changes, *others, **options)
        Fixture(server, changes)
        return server

    monkeypatch.setattr(service, "make_server", with_fixture)
    with bus() as b:
        yield b.start(SERVICE).detail["mcp"]


@pytest.mark.parametrize("revision", ["2025-06-18", "2025-11-25", "2026-07-28"])
def test_the_gateway_conforms(url: str, revision: str, tmp_path: Path) -> None:
    ran = subprocess.run(
        [
            str(PROGRAMS / "conformance"), "server", "--suite", "all", "--url", url, "--spec-version", revision,
            "--expected-failures", str(EXPECTED), "--output-dir", str(tmp_path),
        ],
        env={**os.environ, "PATH": f"{PROGRAMS}:{os.environ['PATH']}"},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    summary = ran.stdout.rpartition("=== SUMMARY ===")[2]
    assert ran.returncode == 0, summary + ran.stderr[-2000:]
    assert int(re.findall(r"Total: (\d+) passed", summary)[0]) >= LEAST[revision], summary
