"""`python scripts/mcp_bundle.py [--wheel FILE] [--url URL] [--out FOLDER]`: a bundle for desktop clients, and server.json for the registry.

The bundle holds our wheel; the client's `uv` fetches what it depends on. With the same wheel the bundle is the same, byte for byte.
`--url`: where the bundle will lie; without it server.json names no package.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
NAME = "io.github.drivemcp/drivemcp"
SCHEMA = "https://static.modelcontextprotocol.io/schemas/2025-12-11/server.schema.json"
SUMMARY = "Traffic law with citations, weather, CAN, scene and decisions of a running DriveMCP vehicle"
OPTIONS = {
    "tools": ("Groups of tools", "rules, weather, can, scene, decisions, memory, scenario; with commas; empty: all"),
    "connect": ("Router", "for example tcp/192.168.7.10:7447; empty: the stack that runs on this machine"),
    "vehicle": ("Vehicle", "its name on the bus; empty: that of the stack that runs on this machine"),
    "grant": ("Grant", "file of a signed grant for one actuation tool; empty: none"),
}


def manifest(project: dict[str, Any]) -> dict[str, Any]:
    """The bundle's manifest (MCPB 0.4)."""
    entry = "server/main.py"
    return {
        "manifest_version": "0.4",
        "name": project["name"],
        "display_name": "DriveMCP",
        "version": project["version"],
        "description": SUMMARY,
        "author": {"name": "The DriveMCP authors"},
        "license": project["license"],
        "server": {
            "type": "uv",
            "entry_point": entry,
            "mcp_config": {
                "command": "uv",
                "args": ["run", "--directory", "${__dirname}", entry],
                "env": {f"DRIVEMCP_MCP_{name.upper()}": f"${{user_config.{name}}}" for name in OPTIONS},
            },
        },
        "tools_generated": True,
        "compatibility": {"platforms": ["linux", "darwin"], "runtimes": {"python": project["requires-python"]}},
        "user_config": {
            name: {"type": "string", "title": title, "description": said, "required": False, "default": ""}
            for name, (title, said) in OPTIONS.items()
        },
    }


def environment(project: dict[str, Any], wheel: str) -> str:
    """The bundle's pyproject.toml: our wheel beside it, with what the gateway needs."""
    return (
        f'[project]\nname = "drivemcp-bundle"\nversion = "{project["version"]}"\nrequires-python = "{project["requires-python"]}"\n'
        f'dependencies = ["drivemcp[gateway]"]\n\n[tool.uv]\npackage = false\n\n[tool.uv.sources]\ndrivemcp = {{ path = "{wheel}" }}\n'
    )


def server_json(project: dict[str, Any], name: str, url: str, sha256: str) -> dict[str, Any]:
    """The registry's entry."""
    entry = {
        "$schema": SCHEMA,
        "name": name,
        "title": "DriveMCP",
        "description": SUMMARY,
        "version": project["version"],
    }
    package = {"registryType": "mcpb", "identifier": url, "fileSha256": sha256, "transport": {"type": "stdio"}}
    return {**entry, "packages": [package]} if url else entry


def write_bundle(file: Path, project: dict[str, Any], wheel: Path) -> str:
    """Write it; its SHA-256."""
    parts = {
        "manifest.json": (json.dumps(manifest(project), indent=2) + "\n").encode(),
        "pyproject.toml": environment(project, wheel.name).encode(),
        "server/main.py": (ROOT / "scripts/mcp_bundle_main.py").read_bytes(),
        wheel.name: wheel.read_bytes(),
    }
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as bundle:
        for name, data in parts.items():
            bundle.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return hashlib.sha256(file.read_bytes()).hexdigest()


def read_project() -> dict[str, Any]:
    """What pyproject.toml says of the distribution."""
    project: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return project


def built(folder: Path) -> Path:
    """Our wheel, built by pip."""
    subprocess.run([sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, ROOT], check=True)
    return next(folder.glob("drivemcp-*.whl"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Write bundle and server.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wheel", default="", help="a wheel that is built already")
    parser.add_argument("--url", default="", help="where the bundle will lie")
    parser.add_argument("--name", default=NAME, help="in the registry; its namespace must be the publisher's")
    parser.add_argument("--out", default="out/mcp", help="folder for both files")
    flags = parser.parse_args(arguments)
    out, project = Path(flags.out), read_project()
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"{project['name']}-{project['version']}.mcpb"
    with tempfile.TemporaryDirectory() as folder:
        sha256 = write_bundle(file, project, Path(flags.wheel) if flags.wheel else built(Path(folder)))
    (out / "server.json").write_text(json.dumps(server_json(project, flags.name, flags.url, sha256), indent=2) + "\n")
    sys.stdout.write(f"{file} {sha256}\n{out / 'server.json'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
