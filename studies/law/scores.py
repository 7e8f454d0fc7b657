"""How many answers are right, and in how many the limit is above the law's."""

from collections.abc import Iterable
from typing import Any

import msgspec

from domain.units import to_mps
from proto.rules import RulesAnswer, SignMeaning
from services.rules.authoring.cases import answer, failures
from services.rules.book import RuleBook
from services.rules.packs.format import Case

ROUNDING_MPS = 1e-6


class Score(msgspec.Struct, kw_only=True):
    """Of one pack."""

    asked: int = 0
    right: int = 0
    above: int = 0
    """Answers whose limit is above the expected one, or that know none where there is one."""


class Measured(msgspec.Struct, kw_only=True):
    """Of one source of situations."""

    name: str
    by_pack: dict[str, Score] = {}
    wrong: list[str] = []

    @property
    def all_right(self) -> bool:
        """Whether every answer is right."""
        return bool(self.by_pack) and all(score.right == score.asked for score in self.by_pack.values())

    @property
    def total(self) -> Score:
        """Of all packs together."""
        scores = self.by_pack.values()
        return Score(
            asked=sum(s.asked for s in scores), right=sum(s.right for s in scores), above=sum(s.above for s in scores)
        )


def measure(name: str, book: RuleBook, cases: Iterable[tuple[str, Case]]) -> Measured:
    """Ask them all."""
    found = Measured(name=name)
    for pack, case in cases:
        score = found.by_pack.setdefault(pack, Score())
        wrong = failures(book, case)
        score.asked += 1
        score.right += not wrong
        score.above += above_the_law(case.expect, answer(book, case))
        found.wrong.extend(wrong)
    return found


def above_the_law(expect: dict[str, Any], got: RulesAnswer | SignMeaning) -> bool:
    """Whether more is allowed than expected. Where no limit, or a recommended speed, is expected, nothing is above it."""
    wanted = expect.get("limit")
    if wanted is None or expect.get("advisory"):
        return False
    if got.limit is None or got.limit.advisory:
        return True
    return got.limit.mps > to_mps(wanted[0], wanted[1]) + ROUNDING_MPS
