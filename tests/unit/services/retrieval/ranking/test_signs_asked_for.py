"""A question that names a sign finds the sign's own entry before statutes on its matter."""

import pytest

from services.retrieval.ranking.everyday import law_words, names_a_sign


@pytest.mark.parametrize(
    "text",
    [
        "what does this sign mean",
        "Schild Baustelle",
        "Verkehrszeichen",
        "panneau travaux",
        "welk verkeersbord",
        "znak stop",
        "cartello blu",
        "señal azul",
    ],
)
def test_a_sign_is_named_in_seven_languages(text: str) -> None:
    assert names_a_sign(text)


@pytest.mark.parametrize(
    "text", ["how fast in a town", "Wer hat Vorfahrt", "qui a la priorité", "signature", "assign", "bordeaux"]
)
def test_other_words_name_no_sign(text: str) -> None:
    assert not names_a_sign(text)


@pytest.mark.parametrize(
    ("text", "language", "words"),
    [
        ("A quanto posso andare in autostrada con la nebbia?", "it", ("autostrada", "nebbia")),
        ("¿Puedo adelantar en el arcén con la furgoneta?", "es", ("adelantamiento", "arcén", "furgoneta")),
        ("Posso sorpassare sulle strisce?", "de", ("überholen",)),
    ],
)
def test_italian_and_spanish_say_the_law_s_matters(text: str, language: str, words: tuple[str, ...]) -> None:
    found = law_words(text, language).lower()
    assert [word for word in words if word.lower() not in found] == []
