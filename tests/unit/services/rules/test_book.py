"""Which pack answers, and what its age does to confidence."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivemcp.paths import data
from proto.rules import PostedLimit, Situation
from services.rules.book import RuleBook, load_book, normal_jurisdiction
from services.rules.errors import PackError
from services.rules.limits.limit_answer import applicable_limit
from tests.unit.services.rules.editing import edit, rehash

RURAL = Situation(jurisdiction="DEU", road_type="rural", visibility_m=200.0, wet=False)


@pytest.mark.parametrize(
    ("text", "normal"),
    [
        ("DEU", "DEU"),
        ("de", "DEU"),
        ("gb-wls", "GBR-WLS"),
        ("UK", "GBR"),
        (None, None),
        ("  ", None),
        ("DЕU", None),
        ("DEU; no limits here", None),
    ],
)
def test_jurisdictions_are_taken_in_either_form(text: str | None, normal: str | None) -> None:
    assert normal_jurisdiction(text) == normal


def test_the_extending_pack_answers_for_its_country_alone(book: RuleBook) -> None:
    assert [pack.manifest.id for pack in book.for_jurisdiction("DEU")] == ["DEU-v1-VSL"]
    assert [pack.manifest.id for pack in book.for_jurisdiction(None)] == ["DEU-v1-VSL", "GBR-v1"]


@pytest.mark.parametrize("expected", [{"DEU-v1": "99.0.0"}, {"DEU-v1-VSL": "99.0.0"}])
def test_a_pack_older_than_expected_lowers_confidence_and_says_so(expected: dict[str, str]) -> None:
    folders = [data("rulepacks/DEU-v1"), data("rulepacks/DEU-v1-VSL")]
    fresh = applicable_limit(load_book(folders)[0], RURAL)
    stale = applicable_limit(load_book(folders, expected=expected)[0], RURAL)
    assert stale.limit == fresh.limit
    assert stale.confidence == pytest.approx(0.5 * fresh.confidence)
    assert stale.degraded == ("stale_rulepack",)
    assert "The rulepack (Germany, " in stale.note
    assert f"is older than the expected {next(iter(expected.values()))}." in stale.note


def test_a_pack_as_new_as_expected_does_not_lower_confidence() -> None:
    folders = [data("rulepacks/DEU-v1")]
    book = load_book(folders, expected={"DEU-v1": "1.0.0"})[0]
    assert applicable_limit(book, RURAL) == applicable_limit(load_book(folders)[0], RURAL)


def test_a_pack_not_yet_in_force_lowers_confidence() -> None:
    book = load_book([data("rulepacks/DEU-v1")], today="2020-01-01")[0]
    assert "stale_rulepack" in applicable_limit(book, RURAL).degraded


@pytest.mark.parametrize("settings", [{"expected": {"DEU-v1": "1.9.0"}}, {"today": "2026-01-01"}])
@pytest.mark.parametrize("loaded", [("DEU-v1-VSL",), ("DEU-v1", "DEU-v1-VSL")])
def test_what_is_wrong_with_an_extended_pack_is_told_loaded_or_not(
    settings: dict[str, Any], loaded: tuple[str, ...], copy_pack: Callable[[str], Path]
) -> None:
    folders = {name: copy_pack(name) for name in ("DEU-v1", "DEU-v1-VSL")}
    edit(folders["DEU-v1"] / "manifest.json", lambda m: m.update(effective_until="2025-12-31"))
    rehash(folders["DEU-v1"])
    used = [folders[name] for name in loaded]
    fresh, weak = (applicable_limit(load_book(used, **how)[0], RURAL) for how in ({}, settings))
    assert (fresh.degraded, weak.degraded) == ((), ("stale_rulepack",))
    assert weak.confidence == pytest.approx(0.5 * fresh.confidence)


@pytest.mark.parametrize("today", ["2025-12-31", "20251231", "2025-W52-3", ""])
def test_the_last_day_in_force_counts_in_every_form_of_a_date(today: str, copy_pack: Callable[[str], Path]) -> None:
    folder = copy_pack("DEU-v1")
    edit(folder / "manifest.json", lambda m: m.update(effective_until="2025-12-31"))
    rehash(folder)
    assert applicable_limit(load_book([folder], today=today)[0], RURAL).degraded == ()


@pytest.mark.parametrize("settings", [{"expected": {"DEU-v1": "new"}}, {"today": "tomorrow"}])
def test_malformed_expectations_are_refused(settings: dict[str, object]) -> None:
    with pytest.raises(PackError):
        load_book([data("rulepacks/DEU-v1")], **settings)  # type: ignore[arg-type]


def test_an_unknown_country_gets_the_lowest_limit_of_all_packs_and_both_laws_cited(book: RuleBook) -> None:
    answer = applicable_limit(book, Situation(road_type="rural", visibility_m=200.0, wet=False, lit=False))
    assert answer.limit is not None
    assert (answer.limit.value, answer.limit.unit) == (60, "mph")  # 96.6 km/h, below Germany's 100
    assert {citation.document.split("/")[0] for citation in answer.citations} == {"DEU-v1", "GBR-v1"}
    assert answer.confidence < 0.3


def test_a_country_without_a_pack_is_named_and_its_signs_count(book: RuleBook) -> None:
    sign = PostedLimit(value=40, unit="km/h")
    answer = applicable_limit(book, Situation(jurisdiction="FRA", road_type="rural", posted=(sign,), language="de"))
    assert answer.limit is not None
    assert answer.limit.value == 40
    assert "Frankreich" in answer.note
    assert "jurisdiction" in answer.degraded


def test_citations_come_in_the_drivers_language_where_the_law_stands_in_it(book: RuleBook) -> None:
    for language, word in (("de", "Außerhalb"), ("en", "Outside")):
        answer = applicable_limit(
            book, Situation(jurisdiction="DEU", road_type="rural", visibility_m=99, language=language)
        )
        assert answer.citations[0].excerpt.startswith(word)
        assert answer.citations[0].document.endswith(f".{language}.md")


def test_citations_of_answers_can_be_found_in_the_documents(book: RuleBook) -> None:
    sign = PostedLimit(value=80, unit="km/h", scope="gantry", plates=("plate:when_wet:de",))
    answer = applicable_limit(book, Situation(jurisdiction="DEU", road_type="motorway", posted=(sign,)))
    assert answer.citations
    for citation in answer.citations:
        text = data(f"rulepacks/{citation.document}").read_text(encoding="utf-8")
        assert text[citation.start : citation.end] == citation.excerpt
