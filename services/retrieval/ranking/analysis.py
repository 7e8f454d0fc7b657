"""Text into search terms, language by language: stems, compounds taken apart, sign codes and section numbers kept whole.

A question is analysed against the words of the passages: what none of them has is taken apart, else read as the word it
is most like, so that a slip of the finger costs no answer.
"""

import re
import threading
from collections.abc import Collection, Iterable
from functools import lru_cache

import Stemmer
from rapidfuzz import fuzz, process

from services.retrieval.ranking.everyday import law_words, said_words

_LISTS = {
    "en": """a an and are as at be been being by can could did do does for from had has have how i if in is it its may me might my of
        on or shall should so some such than that the their them then there these they this those to was we were what when where
        which while who whom whose why will with would you your""",
    "de": """aber als also am an auch auf aus bei beim bis da das dass dem den denn der des die dies diese dieser dieses doch du ein
        eine einem einen einer eines er es etwa für gibt hab habe haben hat hatte hier ich ihm ihn ihr ihre im in ist ja jede
        jeder jedes kann kannst können man mein meine mich mir mit muss müssen nach noch nun nur ob oder sein seine sich sie sind so
        soll sollte um und uns vom von war was wenn wer werden wie wieder will wir wird wo zu zum zur""",
    "fr": """à au aux avec c ce ces cet cette d dans de des du elle en est et eux faut il ils j je l la le les leur leurs lui ma mais me
        mes moi mon n ne nos notre nous on ou où par peut peux pour qu que quel quelle quelles quels qui s sa se ses si son sont sur ta
        te tes toi ton tu un une vos votre vous y""",
    "nl": """aan als bij dan dat de der deze die dit door een en er het hij hoe ik in is je kan maar men met mijn moet mag na naar of om
        ook op over te tot u uit van voor waar wat we wel wie wordt worden ze zich zij zijn zo""",
    "pl": """a aby albo ale co czy do dla gdy gdzie i ich ile jak jaka jaki jakie jest jestem jeśli już kiedy kto który która które lub ma
        mam mi mnie mogę może na o od oraz po się są ta tak tam te tej ten to tu w we z za ze że""",
    "it": """a ad ai al alla alle anche c che chi ci come con cosa d da dai dal dalla dalle dei del della delle dello di dove e ed è fra gli
        ha ho i il in io l la le lo ma me mi mio mia ne nei nel nella no non o per però perché più può posso quale quando quanto
        quello questa questo qui se si sono su sua sul sulla suo tra tu un una uno vi""",
    "es": """a al algo aquí como con cual cuando cuanto cuál cuándo de del desde donde dónde e el ella en entre es esa ese esta este esto
        está estoy ha hay he la las le lo los me mi mis muy más no o para pero por porque puede puedo que qué se si sin sobre soy su
        sus tengo tu un una uno y ya yo""",
}
STOPWORDS = {language: frozenset(words.split()) for language, words in _LISTS.items()}


_TERM = re.compile(r"[a-z]{0,2}\d+[a-z]{0,2}(?:[.\-/]\d+[a-z]{0,2})*|[^\W\d_]+", re.UNICODE)
_DIGIT = re.compile(r"\d")
_SNOWBALL = {
    "en": "english",
    "de": "german",
    "fr": "french",
    "nl": "dutch",
    "pl": "polish",
    "it": "italian",
    "es": "spanish",
}
_LINKS = {"de": ("", "s", "es", "n", "en", "er", "e"), "nl": ("", "s", "en", "e")}
"""What joins the parts of a compound, in the languages that write them as one word."""
SHORTEST_PART = 4
SHORTEST_HEAD = 6
"""From this length on a last part counts even if what stands before it is not known."""
SHORTEST_MENDED = 5
MENDED_SHARE = 0.75
ALIKE = 84.0
"""How like a word of the passages (Levenshtein ratio in percent) an unknown word must be to be taken for it."""


class Stem:
    """One Snowball stemmer with a memory, for several threads."""

    def __init__(self, language: str) -> None:
        name = _SNOWBALL.get(language)
        self._stemmer = Stemmer.Stemmer(name) if name else None
        self._lock = threading.Lock()  # a stemmer has one state
        self._remembered = lru_cache(20_000)(self._fresh)

    def __call__(self, word: str) -> str:
        """The stem; the word itself in a language without a stemmer."""
        return self._remembered(word)

    def _fresh(self, word: str) -> str:
        if self._stemmer is None:
            return word
        with self._lock:
            return str(self._stemmer.stemWord(word))


class Analyser:
    """The terms of one language. Immutable once made."""

    def __init__(self, language: str, known: Iterable[str] = ()) -> None:
        """`known`: the texts whose words count as words; without any nothing is taken apart or mended."""
        self.language = language
        self._stem = _stemmer(language)
        self._stopwords = STOPWORDS["en"] | STOPWORDS.get(language, frozenset())  # sections are named in English too
        words = {word for text in known for word in self._words(text) if not _is_code(word)}
        self._stems = frozenset(self._stem(word) for word in words)
        self._parts = lru_cache(20_000)(self._split)
        self._mended = lru_cache(2_000)(self._mend)
        self._alike = lru_cache(2_000)(self._find)
        self._mendable = tuple(sorted(word for word in words if len(word) >= SHORTEST_MENDED))

    def of_passage(self, text: str) -> list[str]:
        """The terms of a passage, repeats included; a compound gives its parts as well."""
        found: list[str] = []
        for word in self._words(text):
            found += _code_parts(word) if _is_code(word) else [self._stem(word), *self._parts(word)]
        return found

    def of_question(self, text: str) -> list[str]:
        """The terms of a question; a word that no passage has is taken apart, else mended."""
        found, said = list[str](), set(self._words(said_words(text, self.language)))
        for word in self._words(text):
            if _is_code(word):
                found += _code_parts(word)
            elif word in said:
                found += [self._stem(word), *self._parts(word)]
            elif (stem := self._stem(word)) in self._stems:
                found += [stem, *self._parts(word)]
            else:
                found += self._parts(word) or self._mended(word)
        law = [term for term in self.of_passage(law_words(self._corrected(text), self.language)) if term in self._stems]
        return found + [term for term in dict.fromkeys(law) if term not in found]

    def known_share(self, text: str) -> float:
        """How much of a question is in words of the passages: 0 to 1; a mended word counts less, as it may be another."""
        words, said = self._words(text), set(self._words(said_words(text, self.language)))
        return sum(1.0 if word in said else self._known(word) for word in words) / len(words) if words else 0.0

    def _known(self, word: str) -> float:
        if _is_code(word) or self._stem(word) in self._stems or self._parts(word):
            return 1.0
        return 0.0 if self._mended(word) == (self._stem(word),) else MENDED_SHARE

    def _corrected(self, text: str) -> str:
        """The question with its slips of the finger mended, where a passage has the word."""
        return _TERM.sub(lambda word: word[0] if _is_code(word[0]) else self._like(word[0].lower()), text)

    def _like(self, word: str) -> str:
        """The word of the passages that an unknown word is most like; the word itself, where none is or it is known."""
        if (
            len(word) < SHORTEST_MENDED
            or word in self._stopwords
            or self._stem(word) in self._stems
            or self._parts(word)
        ):
            return word
        return self._alike(word) or word

    def _words(self, text: str) -> list[str]:
        return [word for word in _TERM.findall(text.lower()) if word not in self._stopwords]

    def _split(self, word: str) -> tuple[str, ...]:
        return _split(word, self._stems, self._stem, _LINKS.get(self.language, ()))

    def _mend(self, word: str) -> tuple[str, ...]:
        like = self._alike(word) if len(word) >= SHORTEST_MENDED else ""
        return (self._stem(like), *self._parts(like)) if like else (self._stem(word),)

    def _find(self, word: str) -> str:
        best = process.extractOne(word, self._mendable, scorer=fuzz.ratio, score_cutoff=ALIKE)
        return "" if best is None else str(best[0])


def _split(word: str, stems: Collection[str], stem: Stem, links: tuple[str, ...]) -> tuple[str, ...]:
    """Stems of the known parts of a compound, or nothing; the longest known last part is what the word is about."""
    if not links:
        return ()
    for at in range(SHORTEST_PART, len(word) - SHORTEST_PART + 1):
        if (last := stem(word[at:])) in stems:
            first = next((found for link in links if (found := _first(word[:at], link, stems, stem, links))), ())
            if first or len(word) - at >= SHORTEST_HEAD:
                return (*first, last)
    return ()


def _first(joined: str, link: str, stems: Collection[str], stem: Stem, links: tuple[str, ...]) -> tuple[str, ...]:
    """The known parts before a link."""
    if not joined.endswith(link) or len(word := joined.removesuffix(link)) < SHORTEST_PART:
        return ()
    return (found,) if (found := stem(word)) in stems else _split(word, stems, stem, links)


def _is_code(word: str) -> bool:
    return not word.isalpha() and _DIGIT.search(word) is not None


def _code_parts(code: str) -> list[str]:
    """`1053-35` is found by itself, by 1053 and by 35."""
    parts = [part for part in re.split(r"[.\-/]", code) if part]
    return [code, *parts] if len(parts) > 1 else [code]


@lru_cache(16)
def _stemmer(language: str) -> Stem:
    return Stem(language)
