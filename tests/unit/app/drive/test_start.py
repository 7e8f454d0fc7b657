"""How a drive begins: what `drivemcp up` starts the stack with."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from app import up
from drivemcp.cli import main
from drivemcp.config import settings_of
from evaluation.scenarios import generate


def started_with(monkeypatch: pytest.MonkeyPatch, *line: str) -> dict[str, Any]:
    """The settings that would be driven with."""
    found: list[dict[str, Any]] = []

    def drive(flags: Any, *_: object, **__: object) -> tuple[int, Path]:
        found.append(settings_of(flags.set))
        return 0, Path()

    monkeypatch.setattr(up, "drive", drive)
    with pytest.raises(SystemExit):
        main(["up", *line])
    return found[0]


def test_a_scenario_begins_where_it_stands_and_speaks_its_drivers_language(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (file := tmp_path / "mine.json").write_bytes(
        msgspec.json.encode(
            msgspec.structs.replace(generate("urb-rain", 0, "test"), country="AUT", driver_language="de")
        )
    )
    found = started_with(monkeypatch, "--scenario", str(file))
    assert found == {"drivelm": {"home": "AUT"}, "orchestrator": {"preferences": {"language": "de"}}}
    shipped = started_with(monkeypatch, "--scenario", "urb-rain")
    assert shipped == {"drivelm": {"home": "DEU"}, "orchestrator": {"preferences": {"language": "en"}}}


def test_what_the_user_sets_comes_before_what_the_scenario_says(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = ("drivelm.home=FRA", "orchestrator.preferences.language=de", "orchestrator.preferences.unit=mph")
    line = [word for each in wanted for word in ("--set", each)]
    found = started_with(monkeypatch, "--scenario", "urb-rain", *line)
    assert found == {"drivelm": {"home": "FRA"}, "orchestrator": {"preferences": {"language": "de", "unit": "mph"}}}
