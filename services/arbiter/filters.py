"""What is held back: `full` is the arbiter. Others hold back less, for comparisons, and are found by entry point.

A distribution registers a `Filter` under `drivemcp.filters`; the name of the entry point is the setting `arbiter.filter`.
"""

from collections.abc import Callable
from typing import NamedTuple

from drivemcp.errors import ConfigError
from drivemcp.registry import registered
from proto.decision import ArbitrationRequest, DecisionKind
from services.arbiter.assessment.assess import Numbers, View
from services.arbiter.profiles.profile import Profile

GROUP = "drivemcp.filters"
FULL = "full"


class Suggested(NamedTuple):
    """For which road user the car would be braked, and the speed to brake from."""

    actor: Numbers
    ego_mps: float


Suggests = Callable[[ArbitrationRequest, View, Profile], Suggested | None]


class Filter(NamedTuple):
    """One that holds back less than the arbiter."""

    said: Callable[[ArbitrationRequest], tuple[DecisionKind, str]]
    """Whether a tick's message is spoken, and why."""
    suggested: Suggests | None = None
    """What is braked for unjudged, in simulation alone; None: braking is judged by the arbiter."""


def filter_of(name: str) -> Filter | None:
    """The filter of that name; None: the arbiter itself. Raises ConfigError."""
    if name == FULL:
        return None
    found = registered(GROUP, name, "arbiter.filter")
    if not isinstance(found, Filter):
        raise ConfigError(f"arbiter.filter = {name}: the entry point is no services.arbiter.filters.Filter")
    return found


def check(name: str, *, lockstep: bool) -> None:
    """Refuse a filter that brakes unjudged on any clock but a simulated one, wherever it is registered. Raises ConfigError.

    In lockstep time moves by the simulator's steps alone (the player refuses lockstep, a wall clock does not step), and
    the CAN service opens no adapter in lockstep: no real car can be driven so.
    """
    chosen = filter_of(name)
    if chosen is not None and chosen.suggested is not None and not lockstep:
        raise ConfigError(f"arbiter.filter = {name} passes everything and is for simulation only: it needs lockstep")
