"""A pack's own test cases: asked of the rule book, and what of the answers does not hold."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from proto.rules import RightOfWayQuestion, RulesAnswer, SignMeaning, Situation
from services.rules.book import RuleBook, load_book
from services.rules.errors import PackError
from services.rules.limits.limit_answer import applicable_limit
from services.rules.packs.format import Case
from services.rules.right_of_way import right_of_way
from services.rules.signs.meaning import SignQuestion, interpret_sign


def answer(book: RuleBook, case: Case) -> RulesAnswer | SignMeaning:
    """What the book answers. Raises PackError where the question breaks the schema."""
    try:
        if case.tool == "applicable_limit":
            return applicable_limit(book, msgspec.convert(case.ask, Situation))
        if case.tool == "right_of_way":
            return right_of_way(book, msgspec.convert(case.ask, RightOfWayQuestion))
        return interpret_sign(book, msgspec.convert(case.ask, SignQuestion))
    except msgspec.ValidationError as error:
        raise PackError(f"case {case.name!r}: ask: {error}") from None


def failures(book: RuleBook, case: Case) -> list[str]:
    """Expectations that do not hold; none: the case passes."""
    found = answer(book, case)
    return [
        f"{case.name}: {field}: expected {wanted!r}, got {_got(found, field)!r}"
        for field, wanted in case.expect.items()
        if not _met(found, field, wanted)
    ]


def _met(found: RulesAnswer | SignMeaning, field: str, wanted: Any) -> bool:
    got = _got(found, field)
    if field == "cites":
        return set(wanted) <= set(got)
    if field == "contains":
        return wanted in got
    if field == "min_confidence":
        return bool(got >= wanted)
    if field == "max_confidence":
        return bool(got <= wanted)
    return bool(got == wanted)


def _got(found: RulesAnswer | SignMeaning, field: str) -> Any:
    if field == "limit":
        return [found.limit.value, found.limit.unit] if found.limit else None
    if field == "advisory":
        return found.limit is not None and found.limit.advisory
    if field == "cites":
        return [citation.provision for citation in found.citations]
    if field == "contains":
        return f"{found.meaning} {found.note}" if isinstance(found, SignMeaning) else found.note
    if field.endswith("_confidence"):
        return found.confidence
    return getattr(found, field, None)


class Trial(msgspec.Struct, frozen=True, kw_only=True):
    """What came of it."""

    pack: str
    cases: int
    failed: int
    lines: tuple[str, ...]
    """Every expectation that does not hold."""


def tried(folder: Path, progress: Callable[[int, int], None] = lambda done, cases: None) -> Trial:
    """Ask every case of the pack alone, with what it extends. Raises PackError where it cannot be used."""
    book, refused = load_book([folder])
    if refused:
        raise PackError(refused[0])
    (pack,) = book.packs.values()
    lines: list[str] = []
    failed = 0
    for done, case in enumerate(pack.cases, start=1):
        try:
            found = failures(book, case)
        except PackError as error:
            found = [str(error)]
        lines += found
        failed += bool(found)
        progress(done, len(pack.cases))
    return Trial(pack=pack.version, cases=len(pack.cases), failed=failed, lines=tuple(lines))
