"""Published runs of other code that count as today's: some of them, drawn by their keys, were driven by today's code, too.

Almost any change of code gives runs other keys, and most changes change no run, or those of one family of places alone. If
every drawn run of a family came out alike, to the bit, so do its others, as far as a draw can say: `may_differ` is the share
that it leaves open. Those whose logs today's code decides otherwise (`redecided.py`) are in no group.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from evaluation.evaluate.published import ALL, Line, came_to
from evaluation.evaluate.store import Kept, Store, driving, measuring
from evaluation.run.spec import key_of
from evaluation.statistics import LEVEL

NAMED = 8
"""More runs than so many are told by their number alone; `redecided.py` tells them by their keys."""


class Group(NamedTuple):
    """The runs of one other code in one family of places, by the keys that today's code gives them."""

    driver: str
    family: str
    lines: Mapping[str, Line]


class Verdict(NamedTuple):
    """What the draw said of a group."""

    group: Group
    alike: tuple[str, ...]
    """Drawn runs that today's code drove, too, and that came out so."""
    otherwise: tuple[str, ...]
    """Runs, drawn or not, that both drove and that did not."""
    lacking: int
    """Drawn, and not driven by today's code."""

    @property
    def counts(self) -> bool:
        """Whether the group's other runs count as today's."""
        return bool(self.alike) and not self.otherwise and not self.lacking

    def told(self) -> str:
        """One clause."""
        name = f"{len(self.group.lines)} runs of other code ({self.group.driver}) in {self.group.family}"
        if self.otherwise:
            return f"{name} do not count: {', '.join(self.otherwise)} came out otherwise by today's"
        if not self.counts:
            return f"{name} do not count: {self.lacking} of those that were drawn are not driven by today's"
        return f"{name} count as today's: {_drawn_alike(len(self.alike))}"


def _drawn_alike(count: int) -> str:
    """What so many drawn runs of a group say of its others."""
    return (
        f"{count} of them, drawn by their keys and driven by today's code as well, came out alike, to the bit; fewer than "
        f"{may_differ(count) * 100:.0f} % of the others would not, with a confidence of {LEVEL * 100:.0f} %"
    )


def sentences(lines: Mapping[str, Line], verdicts: Sequence[Verdict]) -> Iterator[str]:
    """For the report: what of other code counts, what does not, and why."""
    counting = [each for each in verdicts if each.counts]
    yield from (f"{each.told()}." for each in verdicts if not each.counts)
    if counting:
        sizes = ", ".join(f"{len(each.group.lines)} in {each.group.family} ({each.group.driver})" for each in counting)
        count = min(len(each.alike) for each in counting)
        yield f"Runs of other code count as today's: {sizes}. Of each group {_drawn_alike(count)}."
    again = sum(line.redecided_today and line.redecided == "alike" for line in lines.values())
    if again:
        yield f"The logs of {again} runs of other code were decided again by today's, every tick alike."
    odd = sorted(key for key, line in lines.items() if line.refuted)
    if odd:
        named = f": {', '.join(odd)}" if len(odd) <= NAMED else ""
        yield f"{len(odd)} others do not count, as today's decides otherwise in their logs{named}."


def may_differ(alike: int) -> float:
    """The share of runs that may yet differ where so many drawn ones did not: with a larger one, all of these being alike would have
    had a chance below 5 %.
    """
    return float(1.0 - (1.0 - LEVEL) ** (1.0 / alike))


def groups(lines: Mapping[str, Line]) -> tuple[Group, ...]:
    """The runs of other code that today's measures measured, by their code and family, less those that today's decides otherwise."""
    found: dict[tuple[str, str], dict[str, Line]] = {}
    for line in lines.values():
        if not line.of_today and not line.refuted and line.measured_by == measuring():
            place = line.place
            key = key_of(bytes(line.spec), driving(place.sensors))
            found.setdefault((line.driven_by, place.scenario.partition("/")[0]), {})[key] = line
    return tuple(Group(driver, family, found[driver, family]) for driver, family in sorted(found))


def drawn(group: Group, wanted: Iterable[str], count: int) -> tuple[str, ...]:
    """So many of the group's runs that are wanted, by today's keys: hashes of the code, too, so that other code draws others."""
    return tuple(sorted(group.lines.keys() & set(wanted))[:count])


def judged(group: Group, draw: Sequence[str], store: Store, today: Mapping[str, Line]) -> Verdict:
    """Compare what both codes drove, be it here or as published; a run that was not drawn can only speak against the group."""
    same: dict[str, bool] = {}
    for key, line in sorted(group.lines.items()):
        ours = store.here(key) or (today[key].kept() if key in today and today[key].of_today else None)
        if ours is not None:
            same[key] = came_to(line.kept()) == came_to(ours)
    alike = tuple(key for key in draw if same.get(key))
    otherwise = tuple(key for key, is_same in same.items() if not is_same)
    return Verdict(group, alike, otherwise, sum(key not in same for key in draw))


def contradicted(verdicts: Sequence[Verdict]) -> frozenset[str]:
    """Runs of which two groups that count say different things: neither's counts, and today's code drives them."""
    first: dict[str, Line] = {}
    pairs = (
        (key, first.setdefault(key, line), line)
        for each in verdicts if each.counts for key, line in each.group.lines.items()
    )  # fmt: skip
    return frozenset(key for key, one, other in pairs if came_to(one.kept()) != came_to(other.kept()))


def counted(verdict: Verdict, again: Collection[str]) -> dict[str, Kept]:
    """The runs of other code that count, by today's keys, less those that are to be driven again."""
    return {
        key: line.kept() for key, line in verdict.group.lines.items() if verdict.counts and not {key, ALL} & set(again)
    }
