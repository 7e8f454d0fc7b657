"""The front end's language: questions it is asked, and the sentence it says for each class it can tell apart.

The forms follow DriveLM's questions and answers on traffic elements ("What kind of traffic sign is ...?"). The parser
(`parser.py`) reads these sentences back; the pair is a closed loop that a test walks for every class.
"""

from collections.abc import Mapping
from types import MappingProxyType

from services.drivelm.vocabulary.classes import (
    ARROW_LIGHTS,
    BOARD_VALUES,
    LED_VALUES,
    LIMIT_VALUES,
    OTHER,
    SCHOOL_VALUES,
    ZONE_VALUES,
)

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

_SIGN_NAMES = {
    "no_vehicles": "a no vehicles sign",
    "limit_end": "an end of speed limit sign",
    "school_end": "an end of school zone sign",
    "general:50": "a general speed limit in towns sign",
    "general_end": "an end of general speed limit in towns sign",
    "all_end": "an end of all restrictions sign",
    "zone_end": "an end of speed limit zone sign",
    "national": "a national speed limit applies sign",
    "stop": "a stop sign",
    "yield": "a give way sign",
    "priority_road": "a priority road sign",
    "priority_road_end": "an end of priority road sign",
    "priority_here": "a priority at the next junction sign",
    "no_entry": "a no entry sign",
    "no_overtaking": "a no overtaking sign",
    "no_overtaking_end": "an end of no overtaking sign",
    "one_way": "a one way sign",
    "keep_left": "a keep left sign",
    "keep_right": "a keep right sign",
    "ahead_only": "an ahead only sign",
    "roundabout": "a roundabout sign",
    "crossing": "a pedestrian crossing sign",
    "children": "a children warning sign",
    "school": "a school warning sign",
    "roadworks": "a roadworks warning sign",
    "slippery": "a slippery road warning sign",
    "danger": "a general danger warning sign",
    "calm_street": "a traffic calmed area sign",
    "town_entry:yellow": "a yellow town entry sign",
    "town_entry:white": "a white town entry sign",
    "town_entry:dark": "a dark town entry sign",
    "town_exit:yellow": "a yellow town exit sign",
    "town_exit:white": "a white town exit sign",
    "town_exit:dark": "a dark town exit sign",
    "motorway": "a motorway sign",
    "motorway_end": "an end of motorway sign",
    "border:DEU": "a border sign of Germany",
    "border:GBR": "a border sign of the United Kingdom",
    "border:AUT": "a border sign of Austria",
    "border:FRA": "a border sign of France",
    "border:NLD": "a border sign of the Netherlands",
    "border:POL": "a border sign of Poland",
    "border:CHE": "a border sign of Switzerland",
    "info:units_mph": "an information board saying that speeds are in mph",
    "info:units_kmh": "an information board saying that speeds are in km/h",
    "info:side_left": "an information board saying drive on the left",
    "info:side_right": "an information board saying drive on the right",
    "info:interstate": "an interstate road number sign",
}
_PLATE_WORDS = {
    "plate:when_wet:de": "when wet, in German",
    "plate:when_wet:en": "when wet, in English",
    "plate:when_wet:fr": "when wet, in French",
    "plate:when_wet:nl": "when wet, in Dutch",
    "plate:when_wet:pl": "when wet, in Polish",
    "plate:when_wet:drawn": "when wet, as a picture",
    "plate:distance": "a distance",
    "plate:length": "for a length",
    "plate:time": "a time of day",
    "plate:lorries": "lorries only",
    "plate:end": "end",
    "plate:advisory": "an advised speed",
    "plate:arrow_left": "an arrow to the left",
    "plate:arrow_right": "an arrow to the right",
    "plate:arrow_ahead": "an arrow ahead",
}
_PANEL_WORDS = {
    "led:blank": "nothing",
    "led:lane_closed": "a closed lane",
    "led:lane_open": "an open lane",
    "led:end": "the end of all restrictions",
    "led:congestion": "a congestion warning",
    "led:slippery": "a slippery road warning",
}


def _arrow_words(label: str) -> str:
    colour, _, way = label.partition(":")[2].partition("_")
    article = "an" if colour == "amber" else "a"
    return f"{article} {colour} arrow {_WAYS[way]}"


_WAYS = {"left": "to the left", "straight": "ahead", "right": "to the right"}
_LIGHT_WORDS = {
    "light:red": "red",
    "light:red_amber": "red and amber",
    "light:amber": "amber",
    "light:green": "green",
    "light:off": "off",
    **{label: _arrow_words(label) for label in ARROW_LIGHTS},
}


def _table() -> dict[str, str]:
    table = {f"limit:{v}": f"The traffic sign is a speed limit sign of {v}." for v in LIMIT_VALUES}
    table |= {f"zone:{v}": f"The traffic sign is a speed limit zone sign of {v}." for v in ZONE_VALUES}
    table |= {f"limit_board:{v}": f"The traffic sign is a speed limit board of {v}." for v in BOARD_VALUES}
    table |= {f"school_limit:{v}": f"The traffic sign is a school speed limit board of {v}." for v in SCHOOL_VALUES}
    table |= {f"led:{v}": f"The panel shows a speed limit of {v}." for v in LED_VALUES}
    table |= {label: f"The traffic sign is {name}." for label, name in _SIGN_NAMES.items()}
    table |= {label: f"The plate says {words}." for label, words in _PLATE_WORDS.items()}
    table |= {label: f"The panel shows {words}." for label, words in _PANEL_WORDS.items()}
    table |= {label: f"The traffic light is {words}." for label, words in _LIGHT_WORDS.items()}
    return {**table, OTHER: "There is no readable traffic element."}


SENTENCES: Mapping[str, str] = MappingProxyType(_table())
"""Class to sentence."""
