"""The graph's questions of perception and prediction, answered from its nodes; a node that does not know gives no row."""

from collections.abc import Mapping, Sequence

from proto.perception import Track
from proto.scene import QA
from services.drivelm.graph import listing, plan_rules
from services.drivelm.graph.nodes import ELEMENT, Answerer, Node, Seen, side_of
from services.drivelm.graph.templates import Said, row

_MOST_PAIRED = 4
_FRONT = ("front", "front left", "front right")


def rows(nodes: Sequence[Node], seen: Seen) -> list[QA]:
    """Of all, then of each object, then of pairs."""
    return [row("important", important(nodes), parents=()), *_whole(nodes), *_of_each(nodes, seen), *_pairs(nodes)]


def _of_each(nodes: Sequence[Node], seen: Seen) -> list[QA]:
    return [
        row(family, Said(text, node.shown.score), node.shown.tag)
        for family, answerer in _OF_EACH.items()
        for node in nodes
        if (text := answerer(node, seen))
    ]


def important(nodes: Sequence[Node]) -> Said:
    """What matters, in words and tags."""
    if not nodes:
        return Said("None are seen.", 0.0)
    names = [f"a {plain(node)}{_where(node.shown.side)}" for node in nodes]
    tags = ", ".join(node.shown.tag for node in nodes)
    return Said(
        f"There is {', '.join(names)}. The IDs of these objects are {tags}.", min(node.shown.score for node in nodes)
    )


def _where(side: str) -> str:
    return f" to the {side} of the ego vehicle" if side else ""


def plain(node: Node) -> str:
    """What a node is, in a few words."""
    if node.track is not None:
        return f"{plan_rules.status(node.track).lower()} {node.track.kind}"
    if node.fact is not None and node.shown.description and not node.shown.carried:
        return "traffic light" if node.is_light else "traffic sign"
    return node.shown.description.strip(" .").lower() or node.shown.category.lower()


def _status(node: Node, seen: Seen) -> str | None:
    return None if node.shown.moving is None else "Moving." if node.shown.moving else "Stationary."


def _sign_kind(node: Node, seen: Seen) -> str | None:
    if node.fact is None:
        return None
    return "Traffic light." if node.is_light else "Traffic sign." if node.fact.believed else None


def _meaning(node: Node, seen: Seen) -> str | None:
    return node.shown.description if node.fact is not None and node.fact.believed else None


def _considered(node: Node, seen: Seen) -> str | None:
    """The ego is the vehicle that drives towards it; which other road users do is not known."""
    towards = node.track is not None and node.track.in_ego_path
    return "The ego vehicle." if towards or (node.fact is not None and node.fact.believed) else None


_OF_EACH: Mapping[str, Answerer] = {
    "moving": lambda node, seen: plan_rules.moving(node.track, seen.ego) if node.track is not None else None,
    "status": _status,
    "looks": lambda node, seen: node.shown.description or None,
    "sign_or_barrier": lambda node, seen: "Yes." if node.shown.category == ELEMENT else "No.",
    "sign_kind": _sign_kind,
    "meaning": _meaning,
    "in_way": lambda node, seen: None if node.track is None else "Yes." if node.track.in_ego_path else "No.",
    "future": lambda node, seen: plan_rules.future(node.track, seen.ego) if node.track is not None else None,
    "relevant_to": _considered,
    "considered_by": _considered,
}


def _whole(nodes: Sequence[Node]) -> list[QA]:
    shown = [node.shown for node in nodes]
    found = [row("objects_at", said, side=side) for side in _FRONT if (said := listing.objects_at(shown, side))]
    scene, elements, places = listing.scene(shown), _elements(nodes), _positions(nodes)
    any_element = listing.any_element(shown)
    found += [row("scene", scene)] if scene else []
    found += [row("positions", places)] if places else []
    found += [row("any_element", any_element)] if any_element else []
    return [*found, row("elements", elements)] if elements else found


def _elements(nodes: Sequence[Node]) -> Said | None:
    """Category, state and box of each traffic element; a state that is not believed is unknown."""
    elements = [node for node in nodes if node.fact is not None]
    rows_said = ", ".join(f"({_element(node)}, {_box(node)})" for node in elements)
    if not elements:
        return None
    count, score = len(elements), min(node.shown.score for node in elements)
    said = f"There {listing.be(count)} {listing.number(count)} traffic element{'s' * (count > 1)} in the front view."
    return Said(f"{said} The information of these traffic elements is [{rows_said}].", score)


def _element(node: Node) -> str:
    state = (
        node.fact.reading.removeprefix("light:").replace(":", " ") if node.fact and node.fact.believed else "unknown"
    )
    return f"{'traffic light' if node.is_light else 'traffic sign'}, {state}"


def _box(node: Node) -> str:
    return ", ".join(f"{value:.2f}" for value in node.shown.box_px)


def _positions(nodes: Sequence[Node]) -> Said | None:
    placed = [(node.shown, node.track) for node in nodes if node.track is not None][:_MOST_PAIRED]
    said = [
        f"{one.tag} is on the {_relative(track, other_track)} of {other.tag}"
        for at, (one, track) in enumerate(placed)
        for other, other_track in placed[at + 1 :]
    ]
    return Said(", ".join(said) + ".", min(shown.score for shown, _ in placed)) if said else None


def _relative(one: Track, other: Track) -> str:
    along = "front" if one.x_m >= other.x_m else "back"
    across = side_of(one.y_m - other.y_m).removeprefix("front")
    return along + across


def _pairs(nodes: Sequence[Node]) -> list[QA]:
    near = nodes[:_MOST_PAIRED]
    pairs = [(one, other) for one in near for other in near if one is not other]
    return [row("both_signs", _both(one, other), one.shown.tag, other.shown.tag) for one, other in pairs]


def _both(one: Node, other: Node) -> Said:
    signs = sum(node.shown.category == ELEMENT for node in (one, other))
    text = ("Neither is a traffic sign.", "Only one of the boxes is a traffic sign.", "Both are traffic signs.")[signs]
    return Said(text, min(one.shown.score, other.shown.score))
