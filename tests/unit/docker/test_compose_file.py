"""What docker-compose.yml and the Dockerfile say, without an engine: every service, hardened, with its own credentials alone."""

import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml  # type: ignore[import-untyped]

from drivemcp.registry import module_of
from proto.services import BY_NAME, SERVICES

ROOT = Path(__file__).parents[3]
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text(encoding="utf-8"))
CONTAINERS: dict[str, dict[str, Any]] = {n: c for n, c in COMPOSE["services"].items() if "profiles" not in c}
BORROWED: dict[str, dict[str, Any]] = {n: c for n, c in COMPOSE["services"].items() if "profiles" in c}
"""Other projects' images, started only where asked."""
DOCKERFILE = (ROOT / "docker/Dockerfile").read_text(encoding="utf-8")
IGNORED = (ROOT / ".dockerignore").read_text(encoding="utf-8")
REQUIREMENTS: dict[str, Any] = runpy.run_path(str(ROOT / "docker/requirements.py"))
LAYERS: dict[str, tuple[str, ...]] = REQUIREMENTS["LAYERS"]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ROWS = sorted({row.name for row in SERVICES} - {"player"})
"""The player brings recordings in the simulator's place; the demo has the simulator."""
LIVING = [*ROWS, "router"]


def stages() -> dict[str, tuple[str, list[str]]]:
    """Each stage of the Dockerfile: what it starts from, and its instructions."""
    found: dict[str, tuple[str, list[str]]] = {}
    lines: list[str] = []  # what stands above the first stage
    joined = DOCKERFILE.replace("\\\n", " ")
    for line in (line for line in joined.splitlines() if line and not line.startswith("#")):
        if start := re.fullmatch(r"FROM (\S+) AS (\S+)", line):
            lines = []
            found[start[2]] = (start[1], lines)
        else:
            lines.append(line)
    return found


STAGES = stages()


def instructions(target: str) -> list[str]:
    """All instructions of an image, from the bottom up."""
    parent, own = STAGES[target]
    return ([*instructions(parent)] if parent in STAGES else []) + own


def volumes(name: str) -> dict[str, str]:
    """Where each volume of a container is mounted: path to volume, with `:ro` where it may only be read."""
    pairs = [entry.split(":", 1) for entry in CONTAINERS[name].get("volumes", [])]
    return {place: volume for volume, place in pairs}


def test_every_service_of_the_table_has_a_container_and_nothing_else_has() -> None:
    assert set(CONTAINERS) == {*ROWS, "router", "setup"}


def test_the_engine_that_scales_out_is_started_only_where_asked_and_reached_by_retrieval_alone() -> None:
    (engine,) = BORROWED.values()
    assert engine["profiles"] == ["scale"]
    assert re.fullmatch(r"\$\{QDRANT_IMAGE:-qdrant/qdrant:v\d+\.\d+\.\d+-unprivileged\}", engine["image"])
    assert engine["networks"] == ["engine"]
    assert "ports" not in engine
    assert COMPOSE["networks"]["engine"]["internal"] is True
    assert [name for name, container in CONTAINERS.items() if "engine" in container.get("networks", [])] == [
        "retrieval"
    ]
    assert instructions("retrieval-qdrant")[-1].endswith(f'"engine_url={next(iter(BORROWED))}:6333"]')


@pytest.mark.parametrize("name", ROWS)
def test_the_memory_limit_is_the_tables(name: str) -> None:
    assert CONTAINERS[name]["mem_limit"] == f"{BY_NAME[name].memory_mb}m"


@pytest.mark.parametrize("name", sorted(COMPOSE["services"]))
def test_a_container_is_hardened_and_bounded(name: str) -> None:
    container = COMPOSE["services"][name]
    assert container["read_only"] is True
    assert container["cap_drop"] == ["ALL"]
    assert "cap_add" not in container
    assert container.get("privileged", False) is False
    assert "no-new-privileges:true" in container["security_opt"]
    assert container["mem_limit"]
    assert container["pids_limit"]


@pytest.mark.parametrize("name", sorted(CONTAINERS))
def test_a_container_runs_as_a_user_who_is_not_root(name: str) -> None:
    assert "user" not in CONTAINERS[name]
    last = [line for line in instructions(CONTAINERS[name]["build"]["target"]) if line.startswith("USER ")][-1]
    assert int(last.split()[1]) >= 1000


@pytest.mark.parametrize("name", LIVING)
def test_a_container_is_watched_and_restarted(name: str) -> None:
    assert CONTAINERS[name]["restart"] == "unless-stopped"
    check = CONTAINERS[name]["healthcheck"]
    assert check["test"][0] in ("CMD", "CMD-SHELL")
    heartbeat = [argument for argument in CONTAINERS[name]["command"] if argument.startswith("--set=heartbeat_file=")]
    assert name == "router" or heartbeat[0].split("=", 2)[2] in check["test"][1]


@pytest.mark.parametrize("name", LIVING)
def test_a_container_holds_its_own_credentials_alone_and_cannot_change_them(name: str) -> None:
    kept = {place: volume for place, volume in volumes(name).items() if volume.startswith("secrets-")}
    assert kept == {f"/secrets/{name}:ro": f"secrets-{name}"}
    if name != "router":
        assert f"--set=bus.user={name}" in CONTAINERS[name]["command"]
        assert f"--set=bus.password_file=/secrets/{name}/password" in CONTAINERS[name]["command"]


def test_set_up_writes_every_volume_of_credentials_and_reaches_no_network() -> None:
    assert volumes("setup") == {f"/secrets/{name}": f"secrets-{name}" for name in LIVING}
    assert CONTAINERS["setup"]["network_mode"] == "none"
    made = " ".join(instructions("setup"))
    assert all(re.search(rf"\b{name}\b", made) for name in LIVING)


@pytest.mark.parametrize("name", sorted(CONTAINERS))
def test_ports_are_published_on_loopback_only(name: str) -> None:
    ports = CONTAINERS[name].get("ports", [])
    assert all(str(port).startswith("127.0.0.1:") for port in ports)
    assert bool(ports) == (name in ("logger", "gateway", "cockpit"))
    assert bool(ports) == ("face" in CONTAINERS[name].get("networks", []))


def test_the_bus_leads_nowhere_else_and_its_router_asks_who_is_there() -> None:
    assert COMPOSE["networks"]["bus"]["internal"] is True
    arguments = CONTAINERS["router"]["command"]
    assert "--access=/secrets/router/access.json" in arguments
    assert "--credentials=/secrets/router/users.txt" in arguments


def test_the_simulator_waits_for_all_that_sense_and_decide() -> None:
    assert set(CONTAINERS["simulator"]["depends_on"]) == {*LIVING} - {"simulator", "gateway", "cockpit"}


@pytest.mark.parametrize("name", [row.name for row in SERVICES])
def test_an_image_runs_its_service_with_its_own_extra_alone(name: str) -> None:
    row = BY_NAME[name]
    text = "\n".join(instructions(row.name))
    assert instructions(row.name)[-1] == f'ENTRYPOINT ["python3", "-m", "{module_of(row)}"]'
    copied = re.findall(r"COPY --from=requirements /requirements/(\S+)\.txt", text)
    shared = [name for name in copied if name in LAYERS]
    held = {package for layer in shared for package in LAYERS[layer]}
    named = {REQUIREMENTS["name_of"](line) for line in REQUIREMENTS["requirements"](PROJECT)[row.extra]}
    own = [row.extra] if named - held else []
    assert copied == ["base", *shared, *own]
    assert re.findall(r"install-packages (\S+)", text) == ["base", *shared, *(["extra"] if own else [])]
    assert held - {"starlette"} <= named  # which the gateway's SDK brings
    assert "torch" not in text


def test_a_package_that_several_images_hold_is_a_layer_that_they_share() -> None:
    assert all(stages_that_install(layer) == [layer] for layer in LAYERS)
    lists = REQUIREMENTS["requirements"](PROJECT)
    for package in ("numpy", "opencv-python-headless", "onnxruntime", "cryptography"):
        (layer,) = (name for name, packages in LAYERS.items() if package in packages)
        holders = [row for row in SERVICES if package in map(REQUIREMENTS["name_of"], lists[row.extra])]
        below = [row.name for row in holders if f"RUN install-packages {layer}" in instructions(row.name)]
        assert len(below) >= len(holders) - (package == "numpy"), package  # the logger, which stands on the keys


def stages_that_install(layer: str) -> list[str]:
    """The stages with that layer of packages."""
    return [name for name, (_, lines) in STAGES.items() if f"RUN install-packages {layer}" in lines]


def test_only_what_is_published_by_name_is_built_and_no_registry_is_named() -> None:
    bases = {parent for parent, _ in STAGES.values() if parent not in STAGES}
    assert bases == {"${PYTHON_IMAGE}"}
    assert DOCKERFILE.count("\nARG PYTHON_IMAGE=python:3.11-slim\n") == 1
    assert all(
        container["image"] == f"drivemcp-{name}:${{DRIVEMCP_VERSION:-local}}" for name, container in CONTAINERS.items()
    )
    assert not re.search(r"(?:https?|ftp)://", DOCKERFILE)


@pytest.mark.parametrize("name", sorted(CONTAINERS))
def test_an_image_tells_title_version_revision_and_licence_and_no_host(name: str) -> None:
    target = CONTAINERS[name]["build"]["target"]
    text = "\n".join(line for line in instructions(target) if line.startswith("LABEL "))
    labels = {**dict(re.findall(r'(\S+)="([^"]*)"', text)), **CONTAINERS[name]["build"]["labels"]}
    about = {key.removeprefix("org.opencontainers.image."): value for key, value in labels.items()}
    assert about == {
        "title": f"DriveMCP {name}",
        "licenses": PROJECT["license"],
        "version": "${DRIVEMCP_VERSION:-local}",
        "revision": "${DRIVEMCP_REVISION:-unknown}",
    }


def test_all_that_a_build_copies_is_sent_to_the_engine() -> None:
    lines = [line.split()[1:-1] for _, own in STAGES.values() for line in own if re.match(r"COPY (?!--from)", line)]
    copied = {source.removesuffix("/") for sources in lines for source in sources}
    assert copied >= {"NOTICE", "LICENSE", "proto"}
    assert copied <= {line.removeprefix("!") for line in IGNORED.splitlines()}


def test_packages_come_as_wheels_so_that_nothing_is_compiled() -> None:
    assert "pip install --only-binary :all:" in (ROOT / "docker/install").read_text(encoding="utf-8")
    installs = [name for name, (_, own) in STAGES.items() if any("pip install" in line for line in own)]
    assert installs == ["project"]


def test_final_images_hold_no_build_tools() -> None:
    for container in CONTAINERS.values():
        text = "\n".join(instructions(container["build"]["target"]))
        assert "hatchling" not in text
        assert not re.search(r"\b(gcc|g\+\+|build-essential|cmake|curl|wget|git)\b", text)


def test_the_file_for_builds_by_the_hosts_network_names_every_container() -> None:
    extra = yaml.safe_load((ROOT / "docker/build-host-network.yml").read_text(encoding="utf-8"))
    assert extra["services"] == {name: {"build": {"network": "host"}} for name in CONTAINERS}
