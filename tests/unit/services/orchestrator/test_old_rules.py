"""A rulepack that is too old: the driver is told once, and the advice is less sure."""

from typing import Any

import pytest

from proto.rules import RulesAnswer
from tests.unit.services.orchestrator.support import EXPERTS, Drive, Played, end_sign, limit_answer, preferences

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
    naming = [t.advisory for _, _, t in drive.history if "DEU-v1 1.0.0" in t.advisory.justification]
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
