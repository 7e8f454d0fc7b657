"""A pack's own test cases: asked of the rule book, and what of the answers does not hold."""

from typing import Any

import msgspec

from proto.rules import RightOfWayQuestion, RulesAnswer, SignMeaning, Situation
from services.rules.book import RuleBook
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
