"""What is written on training signs: made-up towns, and the usual ways of writing times, distances and conditions."""

from collections.abc import Callable, Mapping

import numpy as np

Chance = np.random.Generator

_PARTS = (
    "Alt",
    "Neu",
    "Ober",
    "Bad ",
    "Klein",
    "Groß",
    "Nieder",
    "Wald",
    "Sand",
    "Stein",
    "Ash",
    "New",
    "West",
    "East ",
)
_ENDS = (
    "stadt", "hausen", "burg", "dorf", "heim", "ingen", "feld", "bach", "ford", "ton", "bury", "ham", "mouth", "ice",
)  # fmt: skip
_TIMES = (
    "{0}-{1} h", "{0} - {1} h", "{0}-{1} Uhr", "{0}h-{1}h", "{0}-{1} u", "Mo-Fr\n{0}-{1} h", "{0}:00-{1}:00", "de {0}h\nà {1}h",
)  # fmt: skip
_TIMES_ENGLISH = (
    "{2} am - {3} pm",
    "Mon - Fri\n{2} am-{3} pm",
    "{2} AM-{3} PM",
    "{2} AM TO {3} PM\nMON-FRI",
    "At any time",
)
_WAYS_TO_SAY: Mapping[str, tuple[str, ...]] = {
    "wet:de": ("bei Nässe", "bei\nNässe", "Bei Nässe"),
    "wet:en": ("when wet", "when\nwet", "WHEN WET", "WHEN\nWET"),
    "wet:fr": ("par temps\nde pluie", "par temps de\npluie", "en cas\nde pluie"),
    "wet:nl": ("bij nat\nwegdek", "bij regen", "bij nat wegdek"),
    "wet:pl": ("podczas\nopadów", "podczas\ndeszczu", "podczas opadów", "na mokrej\njezdni"),
    "school": ("WHEN\nFLASHING", "7-9 AM\n2-4 PM", "ON SCHOOL\nDAYS", "WHEN CHILDREN\nARE PRESENT"),
    "general": ("generell", "Limite générale", "générale", "Allgemein"),
    "arrow": ("", "", "bent"),
}
_LORRY_WORDS = {"USA": ("TRUCKS",), "GBR": ("HGVs only", "Lorries"), "FRA": ("poids lourds",), "DEU": ("Lkw", "")}


def text_for(kind: str, chance: Chance) -> str:
    """The text of a kind: ``town``, ``time``, ``distance``, ``wet:de``, ...; empty for kinds that carry none."""
    if kind in _WAYS_TO_SAY:
        return str(chance.choice(_WAYS_TO_SAY[kind]))
    head, _, country = kind.partition(":")
    return _WRITERS[head](country, chance) if head in _WRITERS else ""


def _town(country: str, chance: Chance) -> str:
    name = str(chance.choice(_PARTS)) + str(chance.choice(_ENDS))
    return f"{name}\nKreis {chance.choice(_PARTS)!s}{chance.choice(_ENDS)!s}" if chance.random() < 0.4 else name


def _time(country: str, chance: Chance) -> str:
    ways = _TIMES_ENGLISH if country in ("GBR", "USA") else _TIMES
    hours = (
        int(chance.integers(0, 24)),
        int(chance.integers(0, 24)),
        int(chance.integers(1, 13)),
        int(chance.integers(1, 13)),
    )
    return str(chance.choice(ways)).format(*hours)


def _distance(country: str, chance: Chance) -> str:
    number, few = int(chance.integers(1, 20)), int(chance.integers(1, 5))
    if country == "USA":
        return str(chance.choice([f"{100 * number} FT", f"{few} MILES", "1/2 MILE", f"{100 * number}\nFEET"]))
    if country == "GBR":
        return str(chance.choice([f"{50 * number} yds", f"{few} miles", "1/2 mile", f"{50 * number} yards"]))
    return str(chance.choice([f"{50 * number} m", f"{50 * number}m", f"in {50 * number} m", f"{few} km"]))


def _length(country: str, chance: Chance) -> str:
    few, metres = int(chance.integers(1, 15)), int(chance.integers(1, 20)) * 50
    return str(chance.choice([f"{few} km", f"{metres} m", f"{few},{int(chance.integers(1, 10))} km"]))


def _lorries(country: str, chance: Chance) -> str:
    return str(chance.choice(_LORRY_WORDS.get(country, ("",)))) if chance.random() < 0.5 else ""


def _number(country: str, chance: Chance) -> str:
    return str(int(chance.integers(1, 100)))


def _advisory(country: str, chance: Chance) -> str:
    return str(5 * int(chance.integers(2, 13)))


_WRITERS: Mapping[str, Callable[[str, Chance], str]] = {
    "town": _town, "time": _time, "distance": _distance, "length": _length, "lorries": _lorries,
    "interstate": _number, "advisory": _advisory,
}  # fmt: skip
