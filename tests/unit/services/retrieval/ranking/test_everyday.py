"""What a driver says is searched for in the law's words, in the language of the passages."""

import pytest

from services.retrieval.library import ABSENT, Library, Request
from services.retrieval.ranking.analysis import Analyser
from services.retrieval.ranking.everyday import alone_in, law_words, matters, matters_in
from services.retrieval.ranking.tuning import Tuning, read_tuning
from training.retrieval.tune import folders


@pytest.mark.parametrize(
    ("said", "language", "law"),
    [
        ("my Transit", "en", "van"),
        ("Brummi", "fr", "poids lourd"),
        ("un 19 tonnes", "en", "lorry"),
        ("permis depuis un an", "fr", "probatoire"),
        ("purée de pois", "en", "fog"),
        ("Tatütata hinter mir", "de", "Blaulicht"),
        ("meine Spur hört auf", "en", "zip"),
        ("hazards on", "de", "Warnblinklicht"),
    ],
)
def test_everyday_words_have_words_of_the_law(said: str, language: str, law: str) -> None:
    assert law in law_words(said, language)


@pytest.mark.parametrize("said", ["a vanilla panneau", "transition", "3,5 t", ""])
def test_parts_of_other_words_say_nothing(said: str) -> None:
    assert matters_in(said) == 0


def test_every_matter_has_words_of_the_law_in_english_and_german() -> None:
    assert [matter.law for matter in matters() if matter.law and not {"en", "de"} <= matter.law.keys()] == []


def test_what_has_no_words_of_the_law_is_no_matter_of_the_law_and_stands_alone() -> None:
    assert [matter.said.pattern for matter in matters() if not matter.law and not matter.alone] == []


@pytest.mark.parametrize(
    ("said", "first"),
    [
        ("Darf mich ein Freund mit dem Seil nach Hause ziehen?", "tow"),
        ("how long can the tow rope be", "tow"),
        ("Kiedy wolno trąbić?", "horn"),
        ("¿Puede ir un patinete por la acera?", "e-scooter"),
    ],
)
def test_a_matter_that_stands_alone_is_known_in_any_language(said: str, first: str) -> None:
    assert [matter.law["en"].split()[0] for matter in alone_in(said)] == [first]


@pytest.mark.parametrize("said", ["tow my caravan on the motorway", "une semi-remorque sur la nationale", "cyclists"])
def test_what_is_no_matter_that_stands_alone_is_searched_for_as_before(said: str) -> None:
    assert alone_in(said) == ()


@pytest.mark.parametrize(
    ("query", "place", "language"),
    [
        ("Mag mijn dochter op een elektrische step rijden?", "NLD", "nl"),
        ("Ile kosztuje przejazd autostradą A4?", "POL", "pl"),
        ("Heb ik een vignet nodig in België?", "BEL", "nl"),
    ],
)
def test_a_matter_on_which_no_passage_of_the_country_speaks_is_refused(query: str, place: str, language: str) -> None:
    library = Library(folders(), read_tuning(), status=ABSENT)
    assert library.search(Request(query=query, jurisdiction=place, language=language)).out_of_scope


def test_a_passage_on_the_matter_comes_before_one_on_something_beside_it() -> None:
    library = Library(folders(), Tuning(lambdas={}), status=ABSENT)
    found = library.search(Request(query="Mag ik bellen achter het stuur?", jurisdiction="BEL", language="nl"))
    assert found.passages[0].passage_id.split("/")[1] == "bel-phone"


def test_the_law_s_words_come_after_the_question_s_and_once() -> None:
    terms = Analyser("en", ["van goods vehicle", "light car"]).of_question("my Transit van")
    assert terms.count("van") == 1
    assert "good" in terms


def test_a_slip_of_the_finger_does_not_hide_a_matter() -> None:
    assert "maximum" in Analyser("en", ["maximum speed limit"]).of_question("my speeed limitt")


def test_a_question_in_a_language_that_the_statutes_lack_is_answered_from_them_all_the_same() -> None:
    library = Library(folders(), Tuning(lambdas={}), status=ABSENT)
    found = library.search(Request(query="couloir de secours dans un bouchon", jurisdiction="DEU", language="fr"))
    assert "deu-emergency-corridor" in [passage.passage_id.split("/")[1] for passage in found.passages]


def test_a_van_on_a_motorway_is_not_answered_with_the_limit_of_all_vehicles_in_towns() -> None:
    assert "Kraftfahrzeuge" not in law_words("ein Transporter mit 3,2 Tonnen", "de")
    query = "Wie schnell darf ein Transporter mit 3,2 Tonnen auf der Autobahn?"
    library = Library(tuple(each for each in folders() if each.name == "DEU-v1"), Tuning(lambdas={}), status=ABSENT)
    found = library.search(Request(query=query, jurisdiction="DEU", corpus="statutes", language="de", k=1))
    assert [passage.passage_id.split("/")[1] for passage in found.passages] == ["deu-speed-advisory"]


@pytest.mark.parametrize("said", ["Reißverschlussverfahren wer darf zuerst", "beim Reißverschluss wer darf fahren"])
def test_who_may_go_first_at_a_merge_is_no_question_of_the_right(said: str) -> None:
    assert "rechts" not in law_words(said, "de")
    assert "rechts" in law_words("wer darf zuerst fahren", "de")


@pytest.mark.parametrize(
    ("pack", "language", "query", "first"),
    [
        ("FRA-v1", "en", "May I tow my friend's broken-down car on the autoroute?", "fra-motorway-recovery"),
        ("FRA-v1", "fr", "Le tramway arrive au carrefour, qui passe en premier ?", "fra-tram-priority"),
        ("FRA-v1", "en", "Can I overtake a stopped school bus in France?", "fra-stop-passengers"),
        ("FRA-v1", "en", "A city bus is pulling out in front of me, must I let it go?", "fra-bus-leaving"),
        ("DEU-v1", "de", "Vor mir hält die Tram und die Leute steigen auf die Fahrbahn aus", "deu-bus-stop"),
        ("CHE-v1", "en", "I'm a new driver in Switzerland, what are my limits on the motorway?", "che-novice"),
    ],
)
def test_what_a_driver_asks_is_answered_with_its_own_rule(pack: str, language: str, query: str, first: str) -> None:
    library = Library(tuple(each for each in folders() if each.name == pack), Tuning(lambdas={}), status=ABSENT)
    asked = Request(query=query, jurisdiction=pack[:3], corpus="statutes", language=language, k=1)
    assert [passage.passage_id.split("/")[1] for passage in library.search(asked).passages] == [first]
