"""Mutants of the arbiter: which are tried, and what counts as killed or explained."""

import pytest

from scripts.mutation import Change, change, drawn, explained, fate

NAMES = [f"services.arbiter.state.x_digest__mutmut_{number}" for number in range(1, 50)]
DIFFERENCE = """# services.arbiter.assessment.risk.x_risk__mutmut_3: survived
--- services/arbiter/assessment/risk.py
+++ services/arbiter/assessment/risk.py
@@ -1,3 +1,3 @@
 def risk(ttc_s, profile):
-    urgency = 0.0 if ttc_s is None else 1.0
+    urgency = 1.0 if ttc_s is None else 1.0
     return urgency
"""


def test_a_sample_is_drawn_by_its_seed_alone() -> None:
    assert drawn(NAMES, 10, 7) == drawn(NAMES[::-1], 10, 7)
    assert drawn(NAMES, 10, 7) != drawn(NAMES, 10, 8)
    assert len(set(drawn(NAMES, 10, 7))) == 10


def test_without_a_number_all_are_tried() -> None:
    assert drawn(NAMES, None, 1) == sorted(NAMES) == drawn(NAMES, 1000, 1)


@pytest.mark.parametrize(
    ("status", "told"),
    [(1, "killed"), (3, "killed"), (0, "survived"), (5, "survived"), (None, "broken off"), (-11, "broken off")],
)
def test_only_a_failed_test_kills(status: int | None, told: str) -> None:
    assert fate(status) == told


def test_a_mutant_is_known_by_what_it_changes_and_not_by_its_number() -> None:
    found = change("services.arbiter.assessment.risk.x_risk__mutmut_3", DIFFERENCE)
    assert found == Change(
        "services.arbiter.assessment.risk.risk",
        "urgency = 0.0 if ttc_s is None else 1.0",
        "urgency = 1.0 if ttc_s is None else 1.0",
    )
    assert found == change("services.arbiter.assessment.risk.x_risk__mutmut_8", DIFFERENCE)


def test_every_explained_survivor_says_why() -> None:
    assert all(each.why and each.before != each.after for each in explained())
