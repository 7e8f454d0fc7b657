"""What is said of kinds and counts of objects by side: it needs the objects alone, as a graph or a file lists them.

A list may miss what was not detected: a count scores at most ``ABSENT``, and so does "No.", which is said only of kinds
and sides that were looked at. A vehicle whose make is not known is counted as a car where cars are asked for.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from proto.scene import SceneGraph, SceneObject
from services.drivelm.graph.nodes import ELEMENT, side_of_tag
from services.drivelm.graph.plan_rules import ABSENT
from services.drivelm.graph.templates import Asked, Said

_NUMBERS = ("no", "one", "two", "three")
_WATCHED = {"front": ("front", "front left", "front right"), "tele": ("front",)}
"""The sides that a camera of ours sees."""
_DETECTED = ("vehicle", "car", "pedestrian")
_MAKES = {
    "car": ["car", "sedan", "suv", "hatchback", "coupe", "van", "taxi", "jeep"],
    "truck": ["truck", "lorry"],
    "bus": ["bus", "coach"],
    "trailer": ["trailer"],
    "motorcycle": ["motorcycle", "motorbike"],
    "bicycle": ["bicycle", "bike"],
    "construction vehicle": ["excavator", "bulldozer", "crane"],
    "pedestrian": ["pedestrian", "person", "people", "worker"],
}
_PLACES = {"front": "in front of the ego car", "back": "behind the ego car"}


def kind_of(shown: SceneObject) -> str:
    """Its kind: by the words it is described with, else by its category."""
    words = set(re.findall(r"[a-z]+", shown.description.lower()))
    made = next((kind for kind, names in _MAKES.items() if words & set(names)), "")
    return made if shown.category != ELEMENT and made else shown.category.lower()


def number(count: int) -> str:
    """A count in DriveLM's words."""
    return _NUMBERS[count] if count < len(_NUMBERS) else "many"


def objects_at(objects: Sequence[SceneObject], side: str) -> Said | None:
    """How many of which kind are on a side; None where nothing is listed."""
    here = [shown for shown in _on(objects, side) if shown.category != ELEMENT]
    counts = Counter(kind_of(shown) for shown in here)
    if not counts:
        return None
    named = _joined([f"{number(count)} {_plural(kind, count)}" for kind, count in counts.items()])
    return Said(f"There {be(next(iter(counts.values())))} {named} {_place(side)}.", _least(here))


def scene(objects: Sequence[SceneObject]) -> Said | None:
    """How many move and stand where; None where of none is known whether it moves."""
    known = [shown for shown in objects if shown.moving is not None and shown.category != ELEMENT]
    counts = Counter((_motion(shown), kind_of(shown), side_of(shown)) for shown in known)
    if not counts:
        return None
    named = [f"{number(n)} {motion} {_plural(kind, n)} {_place(side)}" for (motion, kind, side), n in counts.items()]
    return Said(f"There {be(next(iter(counts.values())))} {_joined(named)}.", _least(known))


def any_element(objects: Sequence[SceneObject]) -> Said | None:
    """Whether a traffic element is listed; None where nothing at all is: the eye may be blind."""
    scores = [shown.score for shown in objects if shown.category == ELEMENT]
    if scores:
        return Said("Yes, there are traffic elements in the front view.", max(scores))
    return Said("No.", ABSENT) if objects else None


def answer(graph: SceneGraph, asked: Asked) -> Said | None:
    """A question whose words fill its form; None for another, or where the list does not tell."""
    answerer = _ANSWERERS.get(asked.family)
    return answerer(graph, *asked.words) if answerer is not None else None


def _status_at(graph: SceneGraph, kind: str, side: str) -> Said | None:
    here = _of_kind(_on(graph.objects, side), _singular(kind))
    if not here or any(shown.moving is None for shown in here):
        return None
    counts = Counter(_motion(shown) for shown in here)
    first, *others = counts.items()
    said = f"{number(first[1])} {_plural(_singular(kind), first[1])} {be(first[1])} {first[0]}"
    more = "".join(f", and {number(count)} {be(count)} {motion}" for motion, count in others)
    return Said(f"{said[0].upper()}{said[1:]}{more}.", _least(here))


def _any_at(graph: SceneGraph, motion: str, kind: str, side: str) -> Said | None:
    here = _of_kind(_on(graph.objects, side), _singular(kind))
    if not here:
        looked = side in _watched(graph) and _singular(kind) in _DETECTED
        return Said("No.", ABSENT) if looked else None
    if not motion:
        return Said("Yes.", max(shown.score for shown in here))
    if motion == "moving" and (going := [shown.score for shown in here if shown.moving]):
        return Said("Yes.", max(going))
    # Whether what stands is parked or stopped is not known.
    otherwise = side in _watched(graph) and all(shown.moving is (motion != "moving") for shown in here)
    return Said("No.", _least(here)) if otherwise else None


_ANSWERERS: Mapping[str, Callable[..., Said | None]] = {
    "objects_at": lambda graph, side: objects_at(graph.objects, side),
    "status_at": _status_at,
    "any_at": _any_at,
    "scene": lambda graph: scene(graph.objects),
}


def side_of(shown: SceneObject) -> str:
    """Where an object is: as the graph knows, else by the camera in its name."""
    return shown.side or side_of_tag(shown.tag)


def _on(objects: Sequence[SceneObject], side: str) -> list[SceneObject]:
    return [shown for shown in objects if side_of(shown) == side]


def _of_kind(objects: Sequence[SceneObject], kind: str) -> list[SceneObject]:
    wanted = {"car": ("car", "vehicle")}.get(kind, (kind,))
    any_make = kind == "vehicle"
    return [s for s in objects if kind_of(s) in wanted or (any_make and s.category.lower() == "vehicle")]


def _watched(graph: SceneGraph) -> tuple[str, ...]:
    """Sides that were looked at for every object. A file lists only what its authors found important, and a graph with
    nothing in it may come from a blind eye."""
    if graph.backend == "annotation" or not graph.objects:
        return ()
    return _WATCHED.get(graph.camera, ())


def _least(objects: Sequence[SceneObject]) -> float:
    return min(ABSENT, *(shown.score for shown in objects))


def _motion(shown: SceneObject) -> str:
    return "moving" if shown.moving else "stationary"


def be(count: int) -> str:
    """Is, or are."""
    return "is" if count == 1 else "are"


def _place(side: str) -> str:
    return _PLACES.get(side, f"to the {side} of the ego car" if side else "on the road")


def _plural(kind: str, count: int) -> str:
    return kind if count == 1 else f"{kind}es" if kind.endswith("s") else f"{kind}s"


def _singular(kind: str) -> str:
    return kind.removesuffix("es") if kind.endswith("ses") else kind.removesuffix("s") if kind != "bus" else kind


def _joined(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
