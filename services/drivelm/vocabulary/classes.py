"""The classes of the small reader, one per whole sign, plate, gantry picture or light state, and the front end's sentence for each.

The classes stand in ``classes.toml``, in the order of the trained network, which carries its own copy of it in
``models/reader.json``; the service refuses a network whose classes it does not know.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

OTHER = "other"

_TABLE: Mapping[str, Any] = tomllib.loads(Path(__file__).with_name("classes.toml").read_text(encoding="utf-8"))
LIMIT_VALUES, LED_VALUES, BOARD_VALUES, SCHOOL_VALUES, ZONE_VALUES = (
    tuple[int, ...](_TABLE["values"][head]) for head in ("limit", "led", "limit_board", "school_limit", "zone")
)

HEIGHTS_M: Mapping[str, float] = _TABLE["height_m"]
"""Usual heights of faces, by what stands before a class's colon."""


def _expanded(kind: str) -> dict[str, str]:
    """The classes of a kind, each with the words that say it: a row of numbers gives a class for each."""
    return {
        code.format(value): words.format(value)
        for code, words in _TABLE[kind].items()
        for value in (_TABLE["values"][code.partition(":")[0]] if "{}" in code else ("",))
    }


_ROUND, _ARROWS = _expanded("round_light"), _expanded("arrow_light")
WORDS: Mapping[str, Mapping[str, str]] = {
    **{kind: _expanded(kind) for kind in ("sign", "plate", "panel")},
    "light": {**_ROUND, **_ARROWS},
}
"""Kind of box to class to the words that say it."""
SIGNS, PLATES, PANELS, LIGHTS = (tuple(WORDS[kind]) for kind in ("sign", "plate", "panel", "light"))
ROUND_LIGHTS, ARROW_LIGHTS = tuple(_ROUND), tuple(_ARROWS)

READER_CLASSES: tuple[str, ...] = (OTHER, *SIGNS, *PLATES, *PANELS, *LIGHTS)

# Which classes make sense for a box of each kind; everything else is set aside before the scores are normalised.
BY_KIND: dict[str, tuple[str, ...]] = {
    "sign": (OTHER, *SIGNS, *PLATES, *PANELS),
    "plate": (OTHER, *PLATES),
    "panel": (OTHER, *PANELS, *SIGNS),
    "light": (OTHER, *LIGHTS),
}


# What a picture of each kind of box is asked.
QUESTIONS: Mapping[str, str] = MappingProxyType(
    {
        "sign": "What kind of traffic sign is shown, and what does it say?",
        "plate": "What does the supplementary plate below the traffic sign say?",
        "panel": "What does the variable message panel on the gantry show?",
        "light": "What is the state of the traffic light?",
    }
)
KIND_OF_QUESTION: Mapping[str, str] = MappingProxyType({question: kind for kind, question in QUESTIONS.items()})

_FORMS = {
    "sign": "The traffic sign is {}.",
    "plate": "The plate says {}.",
    "panel": "The panel shows {}.",
    "light": "The traffic light is {}.",
}
SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        **{code: _FORMS[kind].format(words) for kind, classes in WORDS.items() for code, words in classes.items()},
        OTHER: "There is no readable traffic element.",
    }
)
"""Class to sentence."""
