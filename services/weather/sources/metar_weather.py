"""What falls and what freezes by the words of an airfield's report (METAR), wherever they stand and however they are joined."""

import re
from collections.abc import Iterator, Mapping
from itertools import pairwise

from services.weather.observations.observation import Interval, RoadState

# Intensity in a report -> mm/h as water: light below 2.5, heavy from 10 (WMO No. 8); its upper end ours.
_RAIN = {"-": Interval(0.1, 2.5), "": Interval(2.5, 10.0), "+": Interval(10.0, 50.0)}
_DRIZZLE = {"-": Interval(0.02, 0.2), "": Interval(0.2, 0.5), "+": Interval(0.5, 2.5)}
_SNOW = {"-": Interval(0.1, 1.0), "": Interval(1.0, 2.5), "+": Interval(2.5, 10.0)}
NEARBY = Interval(0.0, 2.5)
_NONE = Interval(0.0, 0.0)
_LIFTED = ("DR", "BL")
"""Drifting and blowing snow lay on the ground before; none falls."""
_FALLS: Mapping[str, tuple[tuple[str, Mapping[str, Interval]], ...]] = {
    "RA": (("rain", _RAIN),),
    "DZ": (("rain", _DRIZZLE),),
    "UP": (("rain", _RAIN), ("snow", _SNOW)),  # unknown precipitation may be either
    "SN": (("snow", _SNOW),),
    "SG": (("snow", _SNOW),),
    "PL": (("snow", _SNOW),),
    "GR": (("rain", _RAIN),),
    "GS": (("snow", _SNOW),),
}
_OTHERS = "VC MI PR BC DR BL SH TS FZ IC BR FG FU VA DU SA HZ PY PO SQ FC SS DS"
_MARKS = "-+/,.;:"
_GROUP = re.compile(rf"[{_MARKS}]*(?:(?:{'|'.join((*_FALLS, *_OTHERS.split()))})[{_MARKS}]*)+")
"""A word that is letters of weather throughout, in any order."""
_NAMED = re.compile("|".join(_FALLS).replace("SN", "SN(?!OCLO)").replace("GR", "GR(?!N)"))
"""What falls, within any word; not an airfield closed by snow, nor the colour of a state (GRN)."""
_UNREAD = re.compile(rf"[-+][A-Z]|{_NAMED.pattern}")
_RECENT = "RE"
_BEFORE = re.compile(r"^.*?\d{6}Z\s")
_BEHIND = re.compile(r"\s(?:TEMPO|BECMG|INTER|PROB[34]0|FCST|NOSIG|NOSPECI|RMKS?|AO[12])\b.*")
"""A trend is a forecast, and remarks tell of before."""


def falls(report: str) -> dict[str, Interval | None]:
    """The most that falls of `rain` and `snow`, as water (mm/h). A report that names none saw none, unless its sensor is missing
    (`//`, in the United States `PWINO`), or a word that may name some cannot be read.
    """
    words = _words(report)
    found = {"rain": _NONE, "snow": _NONE}
    for word in words:
        for kind, amount in _amounts(word):
            found[kind] = max(found[kind], amount, key=lambda each: (each.high, each.low))
    blind = " PWINO" in report or any(map(_hides, words))
    return {kind: None if blind and not amount.high else amount for kind, amount in found.items()}


def road(report: str) -> RoadState | None:
    """What freezes (`FZ`) freezes on the road, whatever the thermometer says, also if it fell within the last hour (`RE`)."""
    freezing = [word for word in _words(report) if "FZ" in word]
    if any(map(_NAMED.search, freezing)):
        return "ice"
    return "frost" if freezing else None


def _words(report: str) -> list[str]:
    """Of what is observed, between the time and a trend or remarks."""
    return _BEHIND.sub("", _BEFORE.sub("", report)).split()


def _hides(word: str) -> bool:
    """Whether something may fall that this word does not tell."""
    if word.startswith(_RECENT):
        return False
    return "/" in word if word == "//" or _GROUP.fullmatch(word) else bool(_UNREAD.search(word))


def _amounts(word: str) -> Iterator[tuple[str, Interval]]:
    """What each two letters of a group stand for. A shower or a storm nearby may reach the road; one that names nothing may be either."""
    if not _GROUP.fullmatch(word):
        return
    letters = re.findall("..", re.sub("[^A-Z]", "", word))
    nearby, unnamed = "VC" in letters, not _FALLS.keys() & set(letters)
    if nearby and unnamed and {"SH", "TS"} & set(letters):
        yield "rain", NEARBY
    elif unnamed and "SH" in letters:
        letters.append("UP")
    for before, each in pairwise(("", *letters)):
        for kind, amounts in _FALLS.get(each, ()) if before not in _LIFTED else ():
            yield kind, NEARBY if nearby else amounts[_intensity(word)]


def _intensity(word: str) -> str:
    """Light where the word begins or ends so; a sign in its middle may be of another part."""
    ends = word.strip("/,.;:")
    return "+" if "+" in word else "-" if "-" in (ends[0], ends[-1]) else ""
