"""Images: those from outside pinned by digest, ours built with labels, and with provenance where buildx is there."""

import os
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

OUTSIDE = re.compile(r"\$\{(\w+_IMAGE):-([^}]+)\}")


def outside(compose: str, environment: Mapping[str, str]) -> dict[str, str]:
    """The images from outside: variable to reference, as the environment has it, else as the compose file does."""
    return {name: environment.get(name, default) for name, default in OUTSIDE.findall(compose)}


def unpinned(images: Mapping[str, str]) -> dict[str, str]:
    """Those that are named by a tag alone."""
    return {name: image for name, image in images.items() if not re.search(r"@sha256:[0-9a-f]{64}$", image)}


def engine() -> str:
    """Why no engine answers; empty where one does."""
    try:
        ran = subprocess.run(["docker", "info"], capture_output=True, text=True, check=False, timeout=30)
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    return "" if ran.returncode == 0 else (ran.stderr.strip().splitlines() or ["docker info fails"])[-1]


def pinned(image: str) -> str:
    """The reference with the digest that its registry tells; as it is where the registry does not answer."""
    subprocess.run(["docker", "pull", "-q", image], capture_output=True, check=False, timeout=600)
    form = "{{range .RepoDigests}}{{println .}}{{end}}"
    ran = subprocess.run(
        ["docker", "image", "inspect", "--format", form, image], capture_output=True, text=True, check=False
    )
    found = re.search(r"@sha256:[0-9a-f]{64}", ran.stdout)
    return f"{image}{found[0]}" if found else image


def build(root: Path, out: Path, variables: Mapping[str, str]) -> None:
    """Build all images; with buildx, images.json in `out` holds their provenance. Raises CalledProcessError."""
    environment = {**os.environ, **variables, "BUILDX_METADATA_PROVENANCE": "max"}
    if subprocess.run(["docker", "buildx", "version"], capture_output=True, check=False).returncode == 0:
        files = os.environ.get("COMPOSE_FILE", "docker-compose.yml").split(":")
        named = [word for file in files for word in ("--file", file)]
        command = [
            "docker",
            "buildx",
            "bake",
            *named,
            "--load",
            "--metadata-file",
            str((out / "images.json").resolve()),
        ]
    else:
        command = ["docker", "compose", "build", "--quiet"]
    subprocess.run(command, cwd=root, env=environment, check=True)
