"""A limit is assumed unless a sign sets it."""

import pytest

from domain.law import assuming
from domain.units import legal_limit
from proto.rules import RulesAnswer


@pytest.mark.parametrize(
    ("basis", "posted", "assumed"),
    [
        ("default", False, True),
        ("default", True, True),
        ("advisory", True, True),
        ("conditional", False, True),
        ("conditional", True, False),
        ("posted", True, False),
        ("zone", True, False),
        ("gantry", True, False),
    ],
)
def test_a_limit_that_a_sign_in_force_sets_is_not_assumed(basis: str, posted: bool, assumed: bool) -> None:
    answer = RulesAnswer(
        legal_action="comply_with_limit", limit=legal_limit(80, "km/h"), citations=(), confidence=0.9, rulepack_version="",
        basis=basis,
    )  # fmt: skip
    marked = assuming(answer, posted=posted).limit
    assert marked is not None
    assert marked.assumed is assumed


def test_no_limit_stays_no_limit() -> None:
    answer = RulesAnswer(
        legal_action="unknown", limit=None, citations=(), confidence=0.0, rulepack_version="", basis="unknown"
    )
    assert assuming(answer, posted=False) is answer
