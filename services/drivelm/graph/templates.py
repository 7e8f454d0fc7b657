"""The question forms of DriveLM: one table, with which the graph asks and with which a question is recognised.

A form in ``UNANSWERED`` is recognised and never answered: what others intend, or what is hidden, is not in our graph.
"""

import re
from collections.abc import Mapping
from typing import Literal, NamedTuple, get_args

from proto.scene import QA
from services.drivelm.graph.tags import ANY_TAG, Point, points
from services.drivelm.vocabulary.text import cleaned

Layer = Literal["perception", "prediction", "planning", "behavior"]
LAYERS: tuple[Layer, ...] = get_args(Layer)
SIDES = ("front left", "front right", "front", "back left", "back right", "back")
_MOST_CHARS = 1200


class Asked(NamedTuple):
    """A recognised question: its family, the objects it names, and the words that fill its form."""

    family: str
    tags: tuple[Point, ...]
    words: tuple[str, ...]


class Said(NamedTuple):
    """An answer and how sure it is."""

    text: str
    score: float


# family: layer, form. {tag} an object, {side} where from the ego, {kind} of object, {motion} of it, * anything after.
FORMS: Mapping[str, tuple[Layer, str]] = {
    "important": ("perception", "What are the important objects in the current scene?*"),
    "moving": ("perception", "What is the moving status of object {tag}?"),
    "status": ("perception", "What is the observed status of object {tag}?"),
    "looks": ("perception", "What is the visual description of {tag}?"),
    "objects_at": ("perception", "What are objects to the {side} of the ego car?"),
    "status_at": ("perception", "What is the status of the {kind} that {be} to the {side} of the ego car?"),
    "any_at": ("perception", "Are there {motion}{kind} to the {side} of the ego car?"),
    "scene": ("perception", "Please describe the current scene."),
    "positions": ("perception", "What is the relative positioning of the important objects in the current scene?"),
    "any_element": ("perception", "Is there any traffic element in the front view?"),
    "elements": ("perception", "Identify all the traffic elements in the front view*"),
    "sign_or_barrier": ("prediction", "Is {tag} a traffic sign or a road barrier?"),
    "both_signs": ("prediction", "Are {tag} and {tag} traffic signs?"),
    "sign_kind": ("prediction", "What kind of traffic sign is {tag}?"),
    "meaning": ("prediction", "What does {tag} mean?"),
    "in_way": ("prediction", "{will} {tag} be in the moving direction of the ego vehicle?"),
    "future": ("prediction", "What is the future state of {tag}?"),
    "relevant_to": ("prediction", "What object would consider {tag} to be most relevant to its decision?"),
    "considered_by": ("prediction", "In this scenario, what object is most likely to consider {tag}?"),
    "notice": ("prediction", "What object should the ego vehicle notice first*"),
    "priority": ("planning", "What is the priority of the objects that the ego vehicle should consider?*"),
    "consider": ("planning", "Is {tag} an object that the ego vehicle should consider in the current scene?"),
    "necessary": ("planning", "Is it necessary for the ego vehicle to take {tag} into account?"),
    "actions": ("planning", "What actions could the ego vehicle take based on {tag}?*"),
    "action": ("planning", "Based on {tag} in this scene, what is the most possible action of the ego vehicle?"),
    "colliding": ("planning", "What actions taken by the ego vehicle can lead to a collision with {tag}?"),
    "risk_braking": ("planning", "What is the probability of colliding with {tag} after the ego vehicle steps on the brakes?"),
    "risk_going_on": (
        "planning",
        "What is the probability of colliding with {tag} after the ego vehicle goes straight and keeps the same speed?",
    ),
    "signal": ("planning", "What is the traffic signal that the ego vehicle should pay attention to?"),
    "target": ("planning", "What is the target action of the ego vehicle?"),
    "safe": ("planning", "In this scenario, what are safe actions to take for the ego vehicle?"),
    "dangerous": ("planning", "In this scenario, what are dangerous actions to take for the ego vehicle?"),
    "behavior": ("behavior", "Predict the behavior of the ego vehicle.*"),
}  # fmt: skip
UNANSWERED: Mapping[str, tuple[Layer, str]] = {
    "other_relevant_to": ("prediction", "Except for the ego vehicle, what object would consider {tag}*"),
    "occluded": ("prediction", "Which object is most likely to be occluded by {tag}?*"),
    "in_way_of": ("prediction", "{will} {tag} be in the moving direction of {tag}?"),
    "takes_into_account": ("prediction", "Would {tag} take {tag} into account?"),
    "changes_for": ("prediction", "Will {tag} change its motion state based on {tag}?"),
    "acts_for": ("prediction", "Based on the observations of {tag}, what are possible actions to be taken by {tag}?*"),
    "risk_turning": ("planning", "What is the probability of colliding with {tag} after the ego vehicle turns*"),
    "comment": ("planning", "What's your comment on this scene?"),
}
_HOLES = {
    "{tag}": ANY_TAG,
    "{side}": f"({'|'.join(SIDES)})",
    "{kind}": r"([a-z]+(?: [a-z]+)?(?: without riders)?)",
    "{motion}": r"(moving |parked |stopped |stationary )?",
    "{be}": "(?:is|are)",
    "{will}": "(?:will|would)",
    "*": ".*",
}


def _pattern(form: str) -> re.Pattern[str]:
    parts = re.split(r"(\{\w+\}|\*)", form.rstrip("?."))
    plain = (_HOLES[part] if part in _HOLES else re.escape(part).replace(r"\?", r"\?*") for part in parts)
    return re.compile("".join(plain) + r"\s*[?.]*", re.IGNORECASE)


_PATTERNS = {name: _pattern(form) for name, (_, form) in {**FORMS, **UNANSWERED}.items()}


def recognise(question: str) -> Asked | None:
    """The family of a question in one of DriveLM's forms; None for any other."""
    plain = cleaned(question, _MOST_CHARS)
    return next((asked for family in _PATTERNS if (asked := in_family(plain, family)) is not None), None)


def in_family(question: str, family: str) -> Asked | None:
    """The question, if it is of this family."""
    match = _PATTERNS[family].fullmatch(question)
    if match is None:
        return None
    return Asked(family, tuple(points(question)), tuple((word or "").strip().lower() for word in match.groups()))


def row(family: str, said: Said, *tags: str, parents: tuple[int, ...] = (0,), **words: str) -> QA:
    """A question of a family with its answer. `tags` and `words` fill the form."""
    layer, form = FORMS[family]
    filled = form.rstrip("*").replace("{will}", "Will")
    for tag in tags:
        filled = filled.replace("{tag}", tag, 1)
    for name, word in words.items():
        filled = filled.replace(f"{{{name}}}", word)
    return QA(layer=layer, question=filled, answer=said.text, score=round(said.score, 4), parents=parents)
