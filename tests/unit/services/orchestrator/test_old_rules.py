"""A rulepack that is too old: the driver is told once, and the advice is less sure."""

from pathlib import Path
from typing import Any

import pytest

from drivemcp.testing import bus
from proto.rules import RulesAnswer
from services.arbiter.service import SERVICE as ARBITER
from services.arbiter.service import ArbiterConfig
from services.orchestrator.service import SERVICE
from services.rules.service import SERVICE as RULES
from services.rules.service import RulesConfig
from tests.unit.services.orchestrator.support import EXPERTS, Drive, Played, end_sign, fact, limit_answer, preferences
from tests.unit.services.orchestrator.test_service import CONFIG, Road, start_car

TOLD = {"en": "Traffic rules out of date", "de": "Verkehrsregeln veraltet"}


def stale(arguments: dict[str, Any]) -> RulesAnswer:
    here = arguments["situation"]["jurisdiction"]
    return limit_answer(50, confidence=0.45, degraded=("stale_rulepack",), rulepack_version=f"{here}-v1@1.0.0#abc")


def driven(seconds: int, language: str = "en") -> Drive:
    drive = Drive(Played({**EXPERTS, "applicable_limit": stale}), preferences=preferences(language=language))
    drive.ticks(10 * seconds)
    return drive


@pytest.mark.parametrize("language", ["en", "de"])
def test_it_is_told_once_in_the_drivers_language(language: str) -> None:
    drive = driven(90, language)
    assert drive.spoken().count(TOLD[language]) == 1


def test_the_notice_names_the_pack_and_other_advice_does_not() -> None:
    drive = driven(20)
    naming = [t.advisory for _, _, t in drive.history if "(Germany, 1.0.0)" in t.advisory.justification]
    spoken = [advisory for advisory in naming if advisory.kind != "SILENT"]
    assert [advisory.directive for advisory in spoken] == [TOLD["en"]]


def test_each_countrys_pack_is_told_once() -> None:
    drive = driven(20)
    for country in ("FRA", "DEU", "FRA"):
        drive.tick(end_sign(f"border:{country}", track_id=20 + drive.seq))
        drive.ticks(200)
    assert drive.spoken().count(TOLD["en"]) == 2


def test_without_staleness_nothing_is_told() -> None:
    drive = Drive()
    drive.ticks(200)
    assert TOLD["en"] not in drive.spoken()


def test_on_the_bus_it_is_spoken_once_and_the_advice_is_less_sure(tmp_path: Path) -> None:
    with bus() as b:
        b.start(RULES, RulesConfig(expected_packs={"DEU-v1": "9.0.0"}))
        b.start(ARBITER, ArbiterConfig(out_dir=str(tmp_path)))
        start_car(b)
        b.start(SERVICE, CONFIG)
        road = Road(b)
        here = (fact("jurisdiction", "DEU"), fact("units", "km/h"), fact("road_type", "urban"))
        told = road.until(*here, want=TOLD["en"])
        assert "The rulepack (Germany, " in told.justification
        assert told.confidence <= 0.5
        later = [road.step(*here) for _ in range(100)]
        assert [each for each in later if each.directive == TOLD["en"] and each.kind != "SILENT"] == []
        assert all("older than" not in each.justification for each in later if each.kind != "SILENT")
