"""Runs a subject: a script in a process of its own that measures and prints one JSON object as its last line."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
PEERS = ROOT / ".venv-peers"
PEER_PACKAGES = ("mcp>=2.3,<3", "uvicorn>=0.30", "grpcio>=1.70", "langgraph>=1.0")


def run_subject(module: str, *arguments: str, peer: bool = False, timeout_s: float = 240) -> dict[str, Any]:
    """The subject's figures. Raises RuntimeError with the end of its output when it fails."""
    python = str(PEERS / "bin" / "python") if peer else sys.executable
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [python, "-m", module, *arguments],
        cwd=ROOT,
        env=environment,
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
    stamp = PEERS / ".made"
    if stamp.exists():
        return
    sys.stderr.write(f"making the peers' environment in {PEERS.name} ({', '.join(PEER_PACKAGES)})\n")
    subprocess.run([sys.executable, "-m", "venv", str(PEERS)], check=True)
    subprocess.run([str(PEERS / "bin" / "pip"), "install", "-q", *PEER_PACKAGES], check=True)
    stamp.touch()
