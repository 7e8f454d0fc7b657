"""The Rules without law: posted numbers in home units, in simulation alone."""

from typing import Any

import pytest

from drivemcp.errors import ConfigError
from drivemcp.testing import bus
from evaluation.baselines.numbers_alone import applicable_limit
from proto.rules import PostedLimit, Situation
from services.rules.service import SERVICE, RulesConfig

FIFTY = PostedLimit(value=50, unit="mph", reading="limit:50")


def test_a_number_counts_in_the_home_unit_and_conditions_are_not_understood() -> None:
    wet = PostedLimit(value=30, unit="mph", scope="when_wet", reading="limit:30")
    answer = applicable_limit(Situation(jurisdiction="GBR", posted=(FIFTY, wet), wet=True))
    assert answer.limit is not None
    assert (answer.limit.value, answer.limit.unit, answer.citations) == (50, "km/h", ())


@pytest.mark.parametrize("road", ["urban", "motorway", None])
def test_no_road_has_a_limit_by_itself(road: Any) -> None:
    answer = applicable_limit(Situation(jurisdiction="DEU", road_type=road))
    assert (answer.limit, answer.legal_action, answer.confidence) == (None, "unknown", 0.0)


def test_it_is_refused_outside_simulation_and_offers_the_same_tools_within() -> None:
    with bus() as b:
        with pytest.raises(ConfigError, match=r"rules\.law.*lockstep"):
            b.start(SERVICE, RulesConfig(law=False))
        b.start(SERVICE, RulesConfig(law=False, lockstep=True))
        outcome = b.call("interpret_sign", {"reading": "stop", "jurisdiction": "DEU"})
        assert outcome.ok, outcome.error
        assert b.call("lookup_rule", {"query": "speed in town"}).ok
        assert b.call("right_of_way", {"question": {"signs": ["stop"]}}).ok
