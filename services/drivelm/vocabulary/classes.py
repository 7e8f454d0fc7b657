"""What the small reader can say of a crop: one class per whole sign, plate, gantry picture or light state.

The classes stand in ``classes.toml``, in the order of the trained network, which carries its own copy of it in
``models/reader.json``; the service refuses a network whose classes it does not know.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

OTHER = "other"

_TABLE: Mapping[str, Any] = tomllib.loads(Path(__file__).with_name("classes.toml").read_text(encoding="utf-8"))
LIMIT_VALUES, LED_VALUES, BOARD_VALUES, SCHOOL_VALUES, ZONE_VALUES = (
    tuple[int, ...](_TABLE["values"][head]) for head in ("limit", "led", "limit_board", "school_limit", "zone")
)


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
