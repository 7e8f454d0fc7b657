"""The paper's risk and utilities, by hand and at their bounds."""

import pytest

from services.arbiter.assessment.risk import risk, utilities
from tests.unit.services.arbiter.support import CALIBRATED

TAU_S = CALIBRATED.tau_s


def test_risk_adds_urgency_violation_and_health_by_their_weights() -> None:
    p = CALIBRATED
    assert risk(None, False, 0.0, p) == 0.0
    assert risk(None, True, 0.0, p) == p.beta
    assert risk(TAU_S / 4.0, False, 0.0, p) == pytest.approx(p.alpha * 0.75)
    assert risk(TAU_S / 4.0, True, 0.5, p) == pytest.approx(p.alpha * 0.75 + p.beta + p.gamma * 0.5)


def test_no_part_of_risk_leaves_its_bounds() -> None:
    p = CALIBRATED
    assert risk(TAU_S, False, 0.0, p) == risk(10.0 * TAU_S, False, -1.0, p) == 0.0
    assert risk(-5.0, False, 0.0, p) == risk(0.0, False, 0.0, p) == pytest.approx(p.alpha)
    assert risk(None, False, 1.7, p) == risk(None, False, 1.0, p) == pytest.approx(p.gamma)


def test_acting_costs_itself_and_its_error_and_speaking_the_drivers_patience() -> None:
    found = utilities(0.8, CALIBRATED)
    assert found.u_act == pytest.approx(0.8 - 0.28 - 0.1)
    assert found.u_speak == pytest.approx(0.1 * 0.8 - 0.05)
    assert found.margin == pytest.approx(found.u_act - found.u_speak)
