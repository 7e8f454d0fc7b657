"""The bundle for desktop clients and the registry's entry, checked by the official tools where npm is there."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from scripts import mcp_bundle
from scripts.mcp_bundle_main import OPTIONS, filled_in
from services.gateway.tool_list import GROUPS

MCPB = "@anthropic-ai/mcpb@2.1.2"
URL = "https://example.org/drivemcp-0.1.0.mcpb"


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A folder with the bundle of a wheel that holds nothing."""
    wheel = tmp_path / "drivemcp-0.1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as file:
        file.writestr("drivemcp/__init__.py", "")
    assert mcp_bundle.main(["--wheel", str(wheel), "--url", URL, "--out", str(tmp_path)]) == 0
    return tmp_path


def bundle(out: Path) -> Path:
    return next(out.glob("*.mcpb"))


def test_the_bundle_holds_manifest_environment_start_and_wheel(out: Path) -> None:
    with zipfile.ZipFile(bundle(out)) as file:
        assert set(file.namelist()) == {
            "manifest.json", "pyproject.toml", "server/main.py", "drivemcp-0.1.0-py3-none-any.whl",
        }  # fmt: skip
        manifest, environment = json.loads(file.read("manifest.json")), file.read("pyproject.toml").decode()
    assert manifest["server"]["entry_point"] in manifest["server"]["mcp_config"]["args"]
    assert set(manifest["user_config"]) == set(OPTIONS)
    assert all(group in manifest["user_config"]["tools"]["description"] for group in GROUPS)
    assert 'path = "drivemcp-0.1.0-py3-none-any.whl"' in environment


def test_the_same_wheel_makes_the_same_bundle(out: Path, tmp_path: Path) -> None:
    project, wheel = mcp_bundle.read_project(), next(tmp_path.glob("*.whl"))
    again = mcp_bundle.write_bundle(tmp_path / "again", project, wheel)
    assert again == hashlib.sha256(bundle(out).read_bytes()).hexdigest()


def test_the_registrys_entry_names_the_bundle_by_its_hash(out: Path) -> None:
    entry = json.loads((out / "server.json").read_text())
    assert re.fullmatch(r"[a-zA-Z0-9.-]+/[a-zA-Z0-9._-]+", entry["name"])
    assert len(entry["description"]) <= 100
    assert entry["version"] == mcp_bundle.read_project()["version"]
    (package,) = entry["packages"]
    assert package["fileSha256"] == hashlib.sha256(bundle(out).read_bytes()).hexdigest()
    assert (package["registryType"], package["identifier"], package["transport"]) == ("mcpb", URL, {"type": "stdio"})


def test_what_was_not_filled_in_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEMCP_MCP_TOOLS", " rules,weather ")
    monkeypatch.setenv("DRIVEMCP_MCP_CONNECT", "${user_config.connect}")
    monkeypatch.setenv("DRIVEMCP_MCP_GRANT", "")
    assert filled_in() == ["--tools", "rules,weather"]


def test_the_start_speaks_for_itself_where_no_stack_runs(tmp_path: Path) -> None:
    root = Path(mcp_bundle.__file__).parents[1]
    environment = {**os.environ, "PYTHONPATH": str(root), "XDG_RUNTIME_DIR": str(tmp_path)}
    ran = subprocess.run(
        [sys.executable, root / "scripts" / "mcp_bundle_main.py"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 2
    assert "no stack is running here" in ran.stderr


@pytest.mark.skipif(
    shutil.which("npx") is None, reason="npm is not installed: the official tool cannot check the bundle"
)
def test_the_official_tool_takes_the_manifest_and_packs_it(out: Path, tmp_path: Path) -> None:
    folder = tmp_path / "unpacked"
    with zipfile.ZipFile(bundle(out)) as file:
        file.extractall(folder)
    for arguments in (["validate", "manifest.json"], ["pack", ".", str(tmp_path / "packed.mcpb")]):
        ran = subprocess.run(
            ["npx", "--yes", MCPB, *arguments], cwd=folder, capture_output=True, text=True, check=False
        )
        if "ENOTFOUND" in ran.stderr or "EAI_AGAIN" in ran.stderr:
            pytest.skip("the npm registry cannot be reached")
        assert ran.returncode == 0, ran.stdout + ran.stderr
    assert zipfile.is_zipfile(tmp_path / "packed.mcpb")
