"""How often a property of safety is tried: a few times in `make test`, 20,000 times a family in `make stack`."""

import math
import os

from hypothesis import HealthCheck, settings

EXAMPLES = int(os.environ.get("SAFETY_EXAMPLES", "0"))
"""Of each family; 0: the few of an ordinary run."""


def safety(few: int, ways: int = 1) -> settings:
    """Settings of one property: a family is a property with all the `ways` that it is asked in."""
    if not EXAMPLES:
        return settings(max_examples=few, deadline=None)
    slow = (HealthCheck.too_slow, HealthCheck.data_too_large)
    return settings(max_examples=max(few, math.ceil(EXAMPLES / ways)), deadline=None, suppress_health_check=slow)
