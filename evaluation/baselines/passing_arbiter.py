"""An arbiter that passes everything: the evaluation's baseline VLM-Tools-NoArbiter. For simulation only.

What the experts' fused advice suggests is taken as it is: its message is spoken where it is new, and where it warns of an
actor the car is asked to brake by what that actor needs. RSS, utilities, the arbiter's own reading, the confidence
threshold and the attention budget are not asked. Bounds of the command, the grant and the driver's pedals stay: they
belong to braking, not to judging.
"""

from collections.abc import Callable

from domain.speech import WARNS
from proto.decision import ArbitrationRequest, DecisionKind
from services.arbiter.assessment.assess import View, each, speak_bounds
from services.arbiter.filters import Filter, Suggested
from services.arbiter.profiles.profile import Profile

KINDS = {"closing_lead": ("vehicle",), "pedestrian": ("pedestrian", "cyclist")}
"""A hazard, as the orchestrator names it, to the kinds of actor that it may mean."""


def suggested(request: ArbitrationRequest, view: View, profile: Profile) -> Suggested | None:
    """The actor nearest in time of those that the advice warns of; `None` without such an actor, or where the speed is unknown."""
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


def said(rows: tuple[Row, ...]) -> Callable[[ArbitrationRequest], tuple[DecisionKind, str]]:
    """Whether a tick's message is passed on, and why: the first row that holds decides."""
    return lambda request: next((kind, reason) for holds, kind, reason in rows if holds(request))


NONE = Filter(said=said(_NEW), suggested=suggested)
"""`arbiter.filter=none`: what is new is spoken, and what the advice warns of is braked for."""
TALKATIVE = Filter(said=said(_ALL))
"""`arbiter.filter=talkative`: the arbiter judges braking as usual, and speaks the message of every tick."""
