"""One answer beside what its prompt held: numbers, units, road users and citations that stand nowhere in it. Pure."""

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from evaluation.baselines.direct.cassette import Line
from evaluation.baselines.direct.forms import ABSTENTION
from evaluation.baselines.direct.parsed_advice import NO_ADVICE, advice_of
from evaluation.statistics import binomial_ci
from evaluation.tables.tables import Value

_NUMBER = re.compile(r"(?<![\w.])(?<!§ )(\d+(?:\.\d+)?)(?:\s*(km/h|mph|kph|m/s|m|%)(?!\w))?")
_CITED = re.compile(r"§+\s*\d+\w*|\b(?:article|art\.|section|sec\.|rule)\s*\d+\w*", re.IGNORECASE)
ACTORS: Mapping[str, re.Pattern[str]] = {
    "vehicle": re.compile(r"\b(?:vehicle|car|truck|lorry|bus|motorcycle)s?\b(?! drives)", re.IGNORECASE),
    "person": re.compile(
        r"\b(?:pedestrian|person|people|cyclist|child|bicycle)(?:s|ren)?\b(?! crossing)", re.IGNORECASE
    ),
}
_THERE: Mapping[str, re.Pattern[str]] = {
    "vehicle": re.compile(r"\ba vehicle is\b", re.IGNORECASE),
    "person": re.compile(r"\ba (?:pedestrian|cyclist) is\b", re.IGNORECASE),
}
"""How the context names those that are there."""


class Count(NamedTuple):
    """So many of so many."""

    found: int
    of: int

    def percent(self) -> Value:
        """The share with its exact interval."""
        share = binomial_ci(self.found, self.of)
        value, low, high = (None if each is None else 100.0 * each for each in (share.value, share.low, share.high))
        return Value(value=value, low=low, high=high, of=f"{self.found} of {self.of}")


class MadeUp(NamedTuple):
    """Of the answers of one method."""

    answers: int
    understood: Count
    """Advice of a known form, or the abstention that the prompt asks for."""
    abstained: Count
    numbers: Count
    """Of the answers with a number those with one that stands nowhere in the prompt."""
    units: Count
    """Of the answers with a number and a unit those whose number stands in the prompt with other units alone."""
    actors: Count
    """Of the answers that name a road user those that name a kind that is not in the context."""
    citations: Count
    """Of the answers that cite those that cite what is in no passage."""


def held(line: Line) -> str:
    """All that the prompt told: scene, passages, tools."""
    return "\n".join((line.context, *line.passages, *line.tools))


def numbers(text: str) -> set[tuple[float, str]]:
    """The numbers in a text, each with its unit; empty: it has none."""
    return {(float(number), unit) for number, unit in _NUMBER.findall(text)}


def abstains(text: str) -> bool:
    """Whether it says nothing, or that it does not know."""
    return not text.strip() or text.strip().rstrip(".").lower() == ABSTENTION.rstrip(".").lower()


def made_up(lines: Iterable[Line]) -> MadeUp:
    """All checks over the answers."""
    told = list(lines)
    numbered = [(numbers(line.text), numbers(held(line))) for line in told if numbers(line.text)]
    united = [({each for each in said if each[1]}, there) for said, there in numbered if any(unit for _, unit in said)]
    named = [(line, kinds) for line in told if (kinds := _kinds(line.text))]
    cited = [(set(_CITED.findall(line.text)), held(line)) for line in told if _CITED.search(line.text)]
    return MadeUp(
        len(told),
        Count(sum(abstains(line.text) or advice_of(line.text) != NO_ADVICE for line in told), len(told)),
        Count(sum(abstains(line.text) for line in told), len(told)),
        Count(sum(not {n for n, _ in said} <= {n for n, _ in there} for said, there in numbered), len(numbered)),
        Count(sum(any(_other_unit(each, there) for each in said) for said, there in united), len(united)),
        Count(sum(any(not _THERE[kind].search(line.context) for kind in kinds) for line, kinds in named), len(named)),
        Count(sum(any(each not in there for each in found) for found, there in cited), len(cited)),
    )


def _kinds(text: str) -> list[str]:
    return [kind for kind, pattern in ACTORS.items() if pattern.search(text.replace("ego vehicle", ""))]


def _other_unit(said: tuple[float, str], there: set[tuple[float, str]]) -> bool:
    """Whether the number is there, but neither with this unit nor, as a sign's may be, without any."""
    units = {unit for number, unit in there if number == said[0]}
    return bool(units) and not units & {said[1], ""}
