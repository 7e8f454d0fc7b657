"""The graph's questions of planning and behaviour, answered by the rules of ``plan_rules`` over its nodes."""

from collections.abc import Callable, Mapping, Sequence

from proto.scene import QA
from services.drivelm.graph import plan_rules
from services.drivelm.graph.nodes import ELEMENT, Answerer, Node, Seen
from services.drivelm.graph.plan_rules import ABSENT, NO_CONCERN
from services.drivelm.graph.templates import Said, row

_ORDINALS = ("Firstly", "Secondly", "Thirdly")


def rows(nodes: Sequence[Node], seen: Seen) -> list[QA]:
    """Planning, then behaviour."""
    order = sorted(nodes, key=lambda node: (node.urgency, node.distance_m))
    each = [
        row(family, Said(text, node.shown.score), node.shown.tag)
        for family, answerer in _OF_EACH.items()
        for node in order
        if node.is_known and (text := answerer(node, seen))
    ]
    whole = [
        row(family, said)
        for family, answerer in _OF_ALL.items()
        if order and (said := answerer(order, seen)) is not None
    ]
    return [*whole, *each, row("behavior", Said(*plan_rules.behavior(seen.ego)), parents=())]


def _concerns(node: Node) -> bool:
    return node.urgency < NO_CONCERN


def _action(node: Node, seen: Seen) -> str | None:
    return plan_rules.action(node.track, node.fact, seen.ego) if _concerns(node) else None


_OF_EACH: Mapping[str, Answerer] = {
    "consider": lambda node, seen: "Yes." if _concerns(node) else "No.",
    "necessary": lambda node, seen: "Yes." if _concerns(node) else "No.",
    "action": _action,
    "actions": lambda node, seen: plan_rules.action_and_reason(node.track, node.fact, seen.ego),
    "colliding": lambda node, seen: plan_rules.colliding(node.track, node.shown.side) if node.track else None,
    "risk_braking": lambda node, seen: plan_rules.risk_braking(node.track) if node.track else None,
    "risk_going_on": lambda node, seen: plan_rules.risk_going_on(node.track) if node.track else None,
}


def _score(nodes: Sequence[Node]) -> float:
    """As sure as the least sure of them; of what was not seen or is but named, half."""
    concern = [node.shown.score if node.is_known else ABSENT for node in nodes if _concerns(node)]
    return min(concern, default=ABSENT)


def _priority(order: Sequence[Node], seen: Seen) -> Said:
    tags = ", ".join(node.shown.tag for node in order)
    said = f"The priority of the objects that the ego vehicle should consider (in descending order) is {tags}."
    return Said(said, _score(order))


def _notice(order: Sequence[Node], seen: Seen) -> Said | None:
    if not all(node.is_known for node in order[: len(_ORDINALS)]):
        return None
    lines = [
        f"{ordinal}, notice {node.shown.tag}. It is {_state(node, seen)}, so the ego vehicle should {_do(node, seen)}."
        for ordinal, node in zip(_ORDINALS, order, strict=False)
    ]
    return Said(" ".join(lines), min(node.shown.score for node in order[:3])) if lines else None


def _state(node: Node, seen: Seen) -> str:
    if node.track is None:
        return "a traffic light" if node.is_light else "a traffic sign"
    words = plan_rules.moving(node.track, seen.ego).rstrip(".").lower()
    return words.replace("turn ", "turning ")


def _do(node: Node, seen: Seen) -> str:
    text = plan_rules.action(node.track, node.fact, seen.ego).rstrip(".")
    return text[0].lower() + text[1:]


def _signal(order: Sequence[Node], seen: Seen) -> Said | None:
    """The light to watch. Where none is seen nothing is said: a missed red light is no "None."."""
    lights = [node for node in order if node.is_light]
    return Said(lights[0].shown.description, lights[0].shown.score) if lights else None


def _target(order: Sequence[Node], seen: Seen) -> Said:
    return Said(plan_rules.target([node.urgency for node in order]), _score(order))


def _safe(order: Sequence[Node], seen: Seen) -> Said:
    return Said(plan_rules.safe([node.urgency for node in order], seen.ego), _score(order))


def _dangerous(order: Sequence[Node], seen: Seen) -> Said:
    sides = [node.shown.side for node in order if node.shown.category != ELEMENT]
    return Said(plan_rules.dangerous([node.urgency for node in order], sides), _score(order))


_OF_ALL: Mapping[str, Callable[[Sequence[Node], Seen], Said | None]] = {
    "priority": _priority,
    "signal": _signal,
    "notice": _notice,
    "target": _target,
    "safe": _safe,
    "dangerous": _dangerous,
}
