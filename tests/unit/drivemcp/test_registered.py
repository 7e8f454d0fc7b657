"""What other distributions register: named where it is missing, and refused in words."""

import pytest

from drivemcp.errors import ConfigError
from drivemcp.registry import registered
from evaluation.baselines.silent import SilentAdvisor


def test_a_registered_name_is_loaded() -> None:
    assert registered("drivemcp.advisors", "silent", "orchestrator.method") is SilentAdvisor


def test_an_unknown_name_is_refused_with_the_setting_and_the_names_that_there_are() -> None:
    with pytest.raises(ConfigError, match=r"orchestrator\.method = nosuch: .*'direct', 'proposer', 'silent'"):
        registered("drivemcp.advisors", "nosuch", "orchestrator.method")
