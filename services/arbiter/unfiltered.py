"""An arbiter that passes everything: the evaluation's baseline VLM-Tools-NoArbiter. For simulation only.

What the experts' fused advice suggests is taken as it is: its message is spoken where it is new, and where it warns of an
actor the car is asked to brake by what that actor needs. RSS, utilities, the arbiter's own reading, the confidence
threshold and the attention budget are not asked. Bounds of the command, the grant and the driver's pedals stay: they
belong to braking, not to judging.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

from drivemcp.errors import ConfigError
from proto.decision import ArbitrationRequest, DecisionKind
from services.arbiter.assess import Numbers, View, each, speak_bounds
from services.arbiter.attention import WARNS
from services.arbiter.profiles import Profile

Filter = Literal["full", "talkative", "none"]
"""`full`: the arbiter. `talkative`: it judges braking, but lets every message of every tick through. `none`: see above."""
KINDS = {"closing_lead": ("vehicle",), "pedestrian": ("pedestrian", "cyclist")}
"""A hazard, as the orchestrator names it, to the kinds of actor that it may mean."""


class Suggested(NamedTuple):
    """For whom the fused advice would brake, and the speed to brake from."""

    actor: Numbers
    ego_mps: float


def check(chosen: Filter, *, lockstep: bool) -> None:
    """Refuse `none` on anything but a simulated clock. Raises ConfigError.

    In lockstep time moves by the simulator's steps alone (the player refuses lockstep, a wall clock does not step), and
    the CAN service opens no adapter in lockstep: no real car can be driven so.
    """
    if chosen == "none" and not lockstep:
        raise ConfigError("arbiter.filter = none passes everything and is for simulation only: it needs lockstep")


def suggested(request: ArbitrationRequest, view: View, profile: Profile) -> Suggested | None:
    """The nearest in time of those of whom the advice warns; None where it warns of nobody, or the speed is unknown."""
    fused = request.fused
    if fused.urgency not in WARNS or request.ego_speed_mps is None:
        return None
    kinds = KINDS.get(fused.hazard, ())
    meant = [n for n in each(view, speak_bounds(view, profile), profile) if n.track.kind in kinds]
    closing = [n for n in meant if n.ttc_s is not None]
    nearest = min(closing, key=lambda n: (n.ttc_s or 0.0, n.track.track_id), default=None)
    return Suggested(nearest, request.ego_speed_mps) if nearest is not None else None


Row = tuple[Callable[[ArbitrationRequest], bool], DecisionKind, str]
_NEW: tuple[Row, ...] = (
    (lambda r: not r.fused.directive, "SILENT", "nothing to say"),
    (lambda r: r.fused.new_information or r.fused.first_notice, "SPEAK", "passed on"),
    (lambda r: True, "SILENT", "nothing new"),
)
_ALL: tuple[Row, ...] = (_NEW[0], (lambda r: True, "SPEAK", "passed on"))
ROWS: dict[Filter, tuple[Row, ...]] = {"none": _NEW, "talkative": _ALL}
"""What is spoken under each filter; the first row that holds decides."""


def said(request: ArbitrationRequest, chosen: Filter) -> tuple[DecisionKind, str]:
    """Whether this tick's message is passed on, and why."""
    return next((kind, reason) for holds, kind, reason in ROWS[chosen] if holds(request))
