"""The words that a pack may use: checked."""

from pathlib import Path

from scripts.vocabulary import as_json, in_use
from services.rules.authoring.validate import validated
from services.rules.authoring.vocabulary import CONDITIONS, FILE, PROHIBITIONS
from services.rules.limits import limit_candidates
from services.rules.lookup import rule_lookup
from tests.unit.services.rules.editing import edit, rehash


def test_the_list_is_that_of_the_packs_and_tables() -> None:
    found = in_use()
    assert FILE.read_bytes() == as_json(found), "run: python scripts/vocabulary.py"


def test_every_word_by_which_the_service_acts_is_explained() -> None:
    assert {word for words in limit_candidates._CITED.values() for word in words} == set(CONDITIONS)
    assert set(rule_lookup._PROHIBITED) == set(PROHIBITIONS)


def test_a_pack_may_have_words_of_its_own(pack: Path) -> None:
    own = [{"type": "condition", "what": "other:sledges"}, {"type": "prohibition", "what": "other:sledge_race"}]
    edit(pack / "provisions.json", lambda p: p[0]["effects"].extend(own))
    edit(pack / "signs.json", lambda s: s.append(s[5] | {"code": "other:sledge_crossing"}))
    rehash(pack)
    assert validated(pack) == ()
