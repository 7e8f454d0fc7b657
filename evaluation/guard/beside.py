"""What is put beside the guard: a governor by RSS alone, and the intelligent driver model as an emergency follower.

Both brake in the place of the arbiter: at its ticks, by its own reading, within the same bounds and through the same receiver.
Neither doubts what it reads, beyond the confidence at which the arbiter warns.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, cast

import msgspec

from domain.rss import GRAVITY_MPS2
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from evaluation.run.grant import EMERGENCY
from proto import topics
from proto.decision import BrakeCommand, Decision
from proto.topics import Topic
from services.arbiter.assessment.assess import Numbers, View, each, speak_bounds
from services.arbiter.assessment.reading import Reading
from services.arbiter.profiles.profile import Profile, load
from services.simulator.car.kinematics import following_mps2

VERSION = "beside 1"
"""Part of the runs' keys: raise the number when a governor brakes otherwise."""
IDM_HEADWAY_S, IDM_STAND_M, IDM_ACCELERATION_MPS2, IDM_BRAKING_MPS2 = 1.6, 2.0, 0.73, 1.67
"""Treiber, Hennecke, Helbing, Phys. Rev. E 62 (2000), table I."""
Governor = Callable[[View, Profile], float]
"""The deceleration to ask for (m/s2); 0: none."""


def rss_mps2(view: View, profile: Profile) -> float:
    """The proper response of RSS to an RSS distance that is violated now: the braking that the distance counts on."""
    if not any(found.rss_viol for found in _ahead(view, profile)):
        return 0.0
    bounds = speak_bounds(view, profile)
    return bounds.mu * GRAVITY_MPS2 * bounds.envelope


def idm_mps2(view: View, profile: Profile) -> float:
    """The model's braking for the road user that asks for most, where that is more than comfortable."""
    ego_mps = view.ego_speed_mps
    if ego_mps is None:
        return 0.0
    demanded = max((_interaction_mps2(ego_mps, found) for found in _ahead(view, profile)), default=0.0)
    return demanded if demanded > IDM_BRAKING_MPS2 else 0.0


def _interaction_mps2(ego_mps: float, found: Numbers) -> float:
    return -following_mps2(
        ego_mps, max(0.0, ego_mps - found.closing_mps), found.gap_m, headway_s=IDM_HEADWAY_S, stand_m=IDM_STAND_M,
        a_mps2=IDM_ACCELERATION_MPS2, b_mps2=IDM_BRAKING_MPS2,
    )  # fmt: skip


def _ahead(view: View, profile: Profile) -> tuple[Numbers, ...]:
    """Road users in the path, as surely seen as it takes to warn of them, at the careful bounds of RSS."""
    measured = each(view, speak_bounds(view, profile), profile)
    return tuple(found for found in measured if found.track.confidence >= profile.hazard_confidence)


BESIDE: Mapping[str, Governor] = MappingProxyType({"RSS only": rss_mps2, "IDM": idm_mps2})
"""By a run's label of the method."""


def governed(service: Service[Any], governor: Governor) -> Service[Any]:
    """The arbiter with the governor's commands in place of its own; any other service as it is."""
    if service.name != "arbiter":
        return service

    def build(config: ServiceConfig, node: Node) -> None:
        node.detail["governor"] = governor.__name__
        service.build(config, cast(Node, GovernedNode(node, governor, load("calibrated"))))

    return Service(service.name, service.config, build)


class GovernedNode:
    """The arbiter's node: each decision is followed by the governor's command, none by the arbiter's."""

    def __init__(self, node: Node, governor: Governor, profile: Profile) -> None:
        self._node, self._governor, self._profile = node, governor, profile

    def __getattr__(self, name: str) -> Any:
        return getattr(self._node, name)

    def publish(self, topic: Topic[Any], message: Any, *, id: str | None = None, stamp_ns: int | None = None) -> None:
        """As a node does; commands are the governor's."""
        if topic is topics.BRAKE:
            return
        self._node.publish(topic, message, id=id, stamp_ns=stamp_ns)
        if topic is topics.DECISION and (command := self._command(message)) is not None:
            self._node.publish(topics.BRAKE, command)

    def _command(self, decision: Decision) -> BrakeCommand | None:
        view = msgspec.convert(decision.own["reading"], Reading).view
        asked_mps2 = min(self._governor(view, self._profile), EMERGENCY.max_deceleration_mps2)
        if asked_mps2 <= 0.0:
            return None
        return BrakeCommand(
            deceleration_mps2=asked_mps2, jerk_mps3=self._profile.act_jerk_mps3, grant_id=EMERGENCY.grant_id,
            tick=decision.tick, envelope="emergency",
        )  # fmt: skip
