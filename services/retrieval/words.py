"""Text into search terms: lower case, light endings cut, section and sign numbers kept whole as well as in parts."""

import re

_TERM = re.compile(r"\d+(?:[.\-]\d+)+|\w+", re.UNICODE)
_ENDINGS = ("ungen", "ing", "ung", "en", "er", "es", "ed", "em", "s", "e", "n")
_COMMON_EN = """a an and are as at be by can do does for from has have how i if in is it may me my no not of on or the there this
to what when where which who will with you your"""
_COMMON_DE = """als am an auf aus bei bis das dem den der des die ein eine einem einen einer es für gilt hat ich ihr im in ist kann man
mit muss nach oder sich sie sind und vom von was welche wenn wer wie wird wo zu zum zur"""
_COMMON_FR = "au aux ce de des du en est et il je la le les ou par pas pour que qui sur un une vous"
_COMMON = frozenset(" ".join((_COMMON_EN, _COMMON_DE, _COMMON_FR)).split())
MIN_STEM = 4


def terms(text: str) -> list[str]:
    """The search terms of a text, repeats included."""
    found: list[str] = []
    for raw in _TERM.findall(text.lower()):
        if raw in _COMMON:
            continue
        found.append(_stem(raw))
        if "-" in raw or "." in raw:
            found.extend(part for part in re.split(r"[.\-]", raw) if part)
    return found


def _stem(word: str) -> str:
    for ending in _ENDINGS:
        if word.endswith(ending) and len(word) - len(ending) >= MIN_STEM:
            return word[: -len(ending)]
    return word
