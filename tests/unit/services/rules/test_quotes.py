"""The check of quotations itself: it finds what is misquoted."""

import msgspec
import pytest

from proto.rules import Situation
from services.rules import citing
from services.rules.book import RuleBook
from services.rules.limits.limit_answer import applicable_limit
from tests.unit.services.rules.quotes import misquoted

TOWN = Situation(jurisdiction="DEU", road_type="urban", visibility_m=300.0)


def test_a_citation_beside_its_text_is_found(book: RuleBook) -> None:
    citation = applicable_limit(book, TOWN).citations[0]
    assert misquoted([citation]) == []
    for wrong in ({"start": citation.start + 1}, {"excerpt": ""}, {"excerpt": citation.excerpt[:-1]}, {"section": ""}):
        assert misquoted([msgspec.structs.replace(citation, **wrong)]) != []


def test_in_these_tests_an_answer_that_misquotes_fails(book: RuleBook) -> None:
    pack = book.packs["DEU-v1"]
    provision = pack.provisions["deu-speed-urban"]
    moved = tuple(msgspec.structs.replace(source, start=source.start + 1) for source in provision.sources)
    with pytest.raises(AssertionError):
        citing.cite(pack, msgspec.structs.replace(provision, sources=moved), "de")
