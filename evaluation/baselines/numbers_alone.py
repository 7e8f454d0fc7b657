"""The Rules without law, for the evaluation's ablation: no provisions, no sign table, no retrieval.

What is left of a limit is its number, taken in the driver's home unit; conditions and plates are not understood, and a
road without a number has no limit known. Abroad that is wrong, and with a home in miles it is too fast: simulation only.
"""

from typing import Any

from domain.units import legal_limit
from drivemcp.node import Node
from proto.rules import RightOfWayQuestion, RulepackInfo, RulesAnswer, SignMeaning, Situation

NOTE = "No law is consulted: the number on the sign, in the driver's unit."


def applicable_limit(situation: Situation) -> RulesAnswer:
    """The lowest number that is posted without a condition; unknown where no such number is posted."""
    numbers = [each for each in situation.posted if each.scope != "when_wet"]
    lowest = min(numbers, key=lambda each: each.value, default=None)
    if lowest is None:
        return unknown()
    return RulesAnswer(
        legal_action="comply_with_limit",
        limit=legal_limit(lowest.value, situation.home_unit),
        citations=(),
        confidence=lowest.confidence,
        rulepack_version="",
        note=NOTE,
        basis="posted",
    )


def unknown() -> RulesAnswer:
    """That nothing is known of the law."""
    return RulesAnswer(
        legal_action="unknown",
        limit=None,
        citations=(),
        confidence=0.0,
        rulepack_version="",
        note=NOTE,
        basis="unknown",
    )


def offer(node: Node) -> None:
    """The tools of the Rules, answering so."""
    node.tool(deadline_ms=40)(applicable_limit)

    @node.tool(deadline_ms=40)
    def interpret_sign(
        reading: str,
        jurisdiction: str | None = None,
        language: str = "en",
        plates: tuple[str, ...] = (),
        candidates: tuple[dict[str, Any], ...] = (),
        home_unit: str = "km/h",
        vehicle_class: str | None = None,
    ) -> SignMeaning:
        """Nothing: there is no sign table."""
        return SignMeaning(
            reading=reading, national_code="", meaning="", language=language, legal_action="unknown", limit=None,
            citations=(), confidence=0.0, rulepack_version="", note=NOTE,
        )  # fmt: skip

    @node.tool(deadline_ms=40)
    def right_of_way(question: RightOfWayQuestion) -> RulesAnswer:
        """Nothing: there are no provisions."""
        return unknown()

    @node.tool(deadline_ms=60)
    def lookup_rule(
        query: str, jurisdiction: str | None = None, language: str = "en", road_context: str = "", k: int = 3
    ) -> RulesAnswer:
        """Nothing: there is no retrieval."""
        return unknown()

    @node.tool(deadline_ms=20)
    def list_rulepacks() -> tuple[RulepackInfo, ...]:
        """None."""
        return ()
