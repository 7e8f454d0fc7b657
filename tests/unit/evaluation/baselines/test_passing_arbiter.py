"""The arbiter that passes everything, and the talkative one."""

import msgspec
import pytest
from hypothesis import given, settings

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.testing import bus
from proto.decision import ArbitrationRequest
from services.arbiter import filters
from services.arbiter.braking.act import Permission
from services.arbiter.decide import decide, redecide
from services.arbiter.filters import Filter
from services.arbiter.service import SERVICE, ArbiterConfig
from services.can.service import SERVICE as CAN
from tests.unit.services.arbiter.support import CALIBRATED, FEW, fused, mirror, request, requests, track

WARNING = fused(directive="Car ahead is braking!", urgency="warning", hazard="closing_lead", confidence=0.1)
FAR = track(gap_m=60.0, closing_mps=3.0)
"""Nothing that violates RSS."""


def test_what_the_advice_warns_of_is_braked_for_whatever_rss_says() -> None:
    asked = request(FAR, fused=WARNING)
    assert decide(asked, mirror(asked), CALIBRATED).decision.kind != "ACT"
    verdict = decide(asked, mirror(asked, filter="none"), CALIBRATED)
    assert verdict.decision.kind == "ACT"
    assert verdict.decision.metrics.rss_viol_high_mu is False
    assert verdict.command is not None
    assert verdict.command.deceleration_mps2 <= CALIBRATED.act_brake_max_mps2


def test_it_brakes_under_a_grant_only() -> None:
    asked = request(FAR, fused=WARNING)
    verdict = decide(asked, mirror(asked, filter="none", permission=Permission()), CALIBRATED)
    assert verdict.command is None
    assert verdict.decision.act_withheld == "no grant"


def test_unsure_advice_is_passed_on_once_and_by_the_talkative_always() -> None:
    unsure = request(None, fused=fused(confidence=0.01))
    again = msgspec.structs.replace(unsure, fused=fused(confidence=0.01, new_information=False))

    def kinds(filter_: str) -> list[str]:
        return [decide(each, mirror(each, filter=filter_), CALIBRATED).decision.kind for each in (unsure, again)]

    assert kinds("full") == ["SILENT", "SILENT"]
    assert kinds("none") == ["SPEAK", "SILENT"]
    assert kinds("talkative") == ["SPEAK", "SPEAK"]


@settings(max_examples=1000, deadline=None)
@given(asked=requests())
def test_the_talkative_brakes_exactly_when_the_full_arbiter_does(asked: ArbitrationRequest) -> None:
    full, other = (decide(asked, mirror(asked, filter=each), CALIBRATED) for each in ("full", "talkative"))
    assert full.command == other.command
    assert full.decision.act_withheld == other.decision.act_withheld


@FEW
@given(asked=requests())
def test_a_logged_decision_is_decided_again_under_its_filter(asked: ArbitrationRequest) -> None:
    decision = decide(asked, mirror(asked, filter="none"), CALIBRATED).decision
    assert redecide(asked, decision, CALIBRATED).decision == decision


def test_it_is_refused_outside_simulation() -> None:
    with bus() as b:
        with pytest.raises(ConfigError, match=r"arbiter\.filter.*lockstep"):
            b.start(SERVICE, ArbiterConfig(filter="none"))
        b.start(SERVICE, ArbiterConfig(filter="none", lockstep=True))


def test_no_real_bus_is_driven_in_lockstep() -> None:
    """So that a car whose settings say lockstep and pass everything by mistake cannot brake either."""
    settings = {"lockstep": True, "buses": [{"interface": "socketcan", "channel": "can0"}]}
    config: ServiceConfig = msgspec.convert(settings, CAN.config)
    with bus() as b, pytest.raises(ConfigError, match=r"lockstep is for simulation"):
        b.start(CAN, config)


def test_a_filter_that_brakes_unjudged_is_refused_outside_simulation_whoever_registers_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    strangers = Filter(said=lambda request: ("SILENT", ""), suggested=lambda request, view, profile: None)
    monkeypatch.setattr(filters, "registered", lambda *_: strangers)
    with pytest.raises(ConfigError, match="lockstep"):
        filters.check("strangers", lockstep=False)
    filters.check("strangers", lockstep=True)
