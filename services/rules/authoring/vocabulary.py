"""The words that a pack may use where a service, or a reader of signs, looks for them; `docs/reference/rulepack-words.md` prints them."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import get_args

import msgspec

from drivemcp.choices import nearest
from proto.rules import Circumstance, Light
from services.rules.errors import Problem
from services.rules.packs.files import Files
from services.rules.packs.format import Condition, Manifest, Prohibition, Provision, RightOfWay, Sign

FILE = Path(__file__).with_name("vocabulary.json")
PAGE = "docs/reference/rulepack-words.md"
OWN = "other:"
"""Begins a word of the pack's own, by which no service acts and which no reader writes."""
SIGN = "sign:"
TRIGGERS = (
    *(f"light:{state}" for state in get_args(Light)), "crossing", "unsigned", *get_args(Circumstance),
)  # fmt: skip
"""Beside `sign:CODE`."""
CONDITIONS = {
    "posted_limit": "cited for a limit on a sign",
    "sign_over_default": "cited for a limit on a sign, as what lets it take the place of the law's own limit",
    "zone": "cited for the limit of a zone",
    "plate:when_wet": "cited for a limit that holds when wet",
    "temporary_over_permanent": "a temporary sign governs a permanent one; without it such an answer is doubted",
    "gantry": "gantries are signs of this law; without it their answers are doubted",
    "gantry_over_permanent": "a gantry governs a permanent sign; without it such an answer is doubted",
    "gantry_plate:when_wet": "cited for a gantry whose limit holds when wet",
}
"""Conditions by which the Rules service acts, and how."""
PROHIBITIONS = {
    "overtaking": "asked in words, `no_overtaking` is answered",
    "entry": "asked in words, `no_entry` is answered",
    "lane": "asked in words, `no_entry` is answered",
}
"""Prohibitions by which the Rules service acts; of any other `proceed_with_care` is answered."""
_ISO_639_1 = """
aa ab ae af ak am an ar as av ay az ba be bg bi bm bn bo br bs ca ce ch co cr cs cu cv cy da de dv dz ee el en eo es et eu fa
ff fi fj fo fr fy ga gd gl gn gu gv ha he hi ho hr ht hu hy hz ia id ie ig ii ik io is it iu ja jv ka kg ki kj kk kl km kn ko
kr ks ku kv kw ky la lb lg li ln lo lt lu lv mg mh mi mk ml mn mr ms mt my na nb nd ne ng nl nn no nr nv ny oc oj om or os pa
pi pl ps pt qu rm rn ro ru rw sa sc sd se sg si sk sl sm sn so sq sr ss st su sv sw ta te tg th ti tk tl tn to tr ts tt tw ty
ug uk ur uz ve vi vo wa wo xh yi yo za zh zu
"""
LANGUAGES = tuple(_ISO_639_1.split())


class Vocabulary(msgspec.Struct, frozen=True, kw_only=True):
    """Words in use, sorted: those of the shipped packs, of the sign readers and of the Rules service."""

    conditions: tuple[str, ...]
    prohibitions: tuple[str, ...]
    signs: tuple[str, ...]
    """Codes."""


@cache
def vocabulary() -> Vocabulary:
    """As `scripts/vocabulary.py` wrote it."""
    return msgspec.json.decode(FILE.read_bytes(), type=Vocabulary)


def check_words(
    files: Files, manifest: Manifest | None, provisions: list[Provision | None], signs: list[Sign | None]
) -> Iterator[Problem]:
    """Words that nothing acts by: misspelt ones, above all."""
    codes = {*vocabulary().signs, *(sign.code for sign in signs if sign)}
    for index, entry in enumerate(provisions):
        for at, effect in enumerate(entry.effects if entry else ()):
            path, shown = (index, "effects", at), entry.id if entry else ""
            for field, word, known in _words(effect, codes):
                yield from _unless_known(files, "provisions.json", (*path, field), word, known, shown)
    for index, sign in enumerate(signs):
        if sign is not None:
            yield from _unless_known(files, "signs.json", (index, "code"), sign.code, vocabulary().signs, sign.code)
    languages = manifest.languages if manifest else ()
    for at, language in enumerate(languages):
        if language not in LANGUAGES:
            message = f"{language!r} is no language of ISO 639-1"
            remedy = f"write one of two letters, as in {', '.join(languages_near(language))}"
            yield files.problem("manifest.json", ("languages", at), message, remedy)
    if manifest is not None:
        yield from _texts(files, manifest, "provisions.json", provisions)
        yield from _texts(files, manifest, "signs.json", signs)


def languages_near(language: str) -> tuple[str, ...]:
    """Codes that begin alike, else usual ones."""
    return tuple(code for code in LANGUAGES if code[0] == language[:1].lower()) or ("en", "de", "fr")


def _words(effect: object, codes: set[str]) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Field, word, and the words that may stand there."""
    if isinstance(effect, RightOfWay):
        yield "trigger", effect.trigger, (*TRIGGERS, *(SIGN + code for code in sorted(codes)))
    elif isinstance(effect, Condition):
        yield "what", effect.what, vocabulary().conditions
    elif isinstance(effect, Prohibition):
        yield "what", effect.what, vocabulary().prohibitions
        if effect.sign:
            yield "sign", effect.sign, tuple(sorted(codes))


def _unless_known(
    files: Files, name: str, path: tuple[str | int, ...], word: str, known: tuple[str, ...], shown: str
) -> Iterator[Problem]:
    if word in known or (word.startswith(OWN) and path[-1] != "trigger"):
        return
    remedy = nearest(word, known) or f"write one of {PAGE}"
    own = f", or {OWN}{word} for what no service acts by" if path[-1] != "trigger" else ""
    yield files.problem(name, path, f"{word!r} is no word that is known here", remedy + own, shown)


def _texts(
    files: Files, manifest: Manifest, name: str, entries: list[Provision | None] | list[Sign | None]
) -> Iterator[Problem]:
    """Texts are in languages that the manifest names."""
    for index, entry in enumerate(entries):
        if entry is None:
            continue
        shown = entry.id if isinstance(entry, Provision) else entry.code
        named: list[tuple[tuple[str | int, ...], str]] = [
            (("sources", at, "language"), source.language) for at, source in enumerate(entry.sources)
        ]
        for field in ("topics", "meaning", "note"):
            named += [((field, language), language) for language in getattr(entry, field, {})]
        for path, language in named:
            if language not in manifest.languages:
                remedy = f"write one of {', '.join(manifest.languages)}, or name it in manifest.json"
                yield files.problem(name, (index, *path), f"{language!r} is no language of this pack", remedy, shown)
