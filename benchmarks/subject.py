"""Runs a subject: a script in a process of its own that measures and prints one JSON object as its last line."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
PEERS = ROOT / ".venv-peers"
LANGGRAPH = ROOT / ".venv-langgraph"
"""Apart from the other peers: langchain-mcp-adapters takes the SDK of MCP below 2."""
LANGGRAPH_PACKAGES = ("langchain-mcp-adapters>=0.3,<1", "langgraph>=1.0,<2")
PEER_PACKAGES = ("mcp>=2.3,<3", "uvicorn>=0.30", "grpcio>=1.70", "langgraph>=1.0")


def run_subject(
    module: str, *arguments: str, peer: bool = False, environment: Path | None = None, timeout_s: float = 240
) -> dict[str, Any]:
    """The subject's figures, in our environment, the peers' or one that is named. Raises RuntimeError with the end of its
    output when it fails.
    """
    where = environment or (PEERS if peer else None)
    python = str(where / "bin" / "python") if where is not None else sys.executable
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [python, "-m", module, *arguments],
        cwd=ROOT,
        env=variables,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
    if ran.returncode != 0:
        raise RuntimeError(f"{module} failed:\n{ran.stdout[-500:]}\n{ran.stderr[-1500:]}")
    figures: dict[str, Any] = json.loads(ran.stdout.strip().splitlines()[-1])
    return figures


def make_peers() -> None:
    """The peers' environment, made once."""
    make_environment(PEERS, PEER_PACKAGES)


def make_environment(folder: Path, packages: Sequence[str]) -> None:
    """An environment of its own with these packages, made once. Raises CalledProcessError where pip fails."""
    stamp = folder / ".made"
    if stamp.exists():
        return
    sys.stderr.write(f"making the peers' environment in {folder.name} ({', '.join(packages)})\n")
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    subprocess.run([str(folder / "bin" / "pip"), "install", "-q", *packages], check=True)
    stamp.touch()
