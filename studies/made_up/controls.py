"""Controls: the same questions without a scene, and with the scene of another moment that says something else."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from evaluation.baselines.direct.cassette import Line
from evaluation.baselines.direct.extractive import extracted
from evaluation.baselines.direct.parsed_advice import advice_of
from evaluation.baselines.direct.template import Asked
from studies.made_up.checks import Count, abstains

Says = Callable[[Asked], str]
"""What the model answers."""


class Controls(NamedTuple):
    """Of the answers of one method."""

    blank: Count
    """Of the questions without a scene those that are answered all the same."""
    stays: Count
    """Of the answers that remain word for word when the scene is another's, which says something else."""


def controls(lines: Sequence[Line], says: Says, most: int) -> Controls:
    """Each question once without a scene, and `most` answers, evenly drawn, each with another's scene."""
    queries = sorted({line.query for line in lines})
    answered = sum(not abstains(says(Asked("", query))) for query in queries)
    swapped = [
        (line, other)
        for line in spread([line for line in lines if not abstains(line.text)], most)
        for other in _others(line, lines)
    ]
    stays = sum(says(other.asked._replace(query=line.query)) == line.text for line, other in swapped)
    return Controls(Count(answered, len(queries)), Count(stays, len(swapped)))


def spread(lines: Sequence[Line], most: int) -> list[Line]:
    """So many of them at most, evenly from first to last."""
    count = min(most, len(lines))
    return [lines[at * len(lines) // count] for at in range(count)]


def _others(line: Line, lines: Sequence[Line]) -> Iterator[Line]:
    """The next answer to the same question in whose scene the reader without a model finds other advice; empty without such an answer."""
    at = lines.index(line)
    ours = _read(line)
    for other in (*lines[at + 1 :], *lines[:at]):
        if other.query == line.query and _read(other) != ours:
            yield other
            return


def _read(line: Line) -> object:
    return advice_of(extracted(line.asked)[0])
