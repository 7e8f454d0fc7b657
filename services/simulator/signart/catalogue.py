"""Every face we can draw: code, size and painter, per country."""

from collections.abc import Callable
from typing import NamedTuple

from services.simulator.signart import america, discs, panels, plates, triangles
from services.simulator.signart.painter import Painter
from services.simulator.signart.sheet import Sheet

Draw = Callable[[Painter, Sheet, str], None]
Size = tuple[float, float]

COUNTRIES = ("DEU", "GBR", "AUT", "FRA", "NLD", "POL", "CHE", "USA")
BORDERS = tuple(country for country in COUNTRIES if country != "USA")
"""Countries whose border signs we draw: no listed country borders on the United States."""


class Face(NamedTuple):
    """How one code is drawn: its size in metres, its painter, and what stands after the code's colon."""

    size_m: Size
    draw: Draw
    argument: str = ""


_DISC: Size = (discs.DISC_M, discs.DISC_M)
_TRIANGLE: Size = (triangles.SIDE_M, triangles.HEIGHT_M)
_STOP: Size = (triangles.STOP_M, triangles.STOP_M)
_DIAMOND: Size = (triangles.DIAMOND_M, triangles.DIAMOND_M)

_KMH = ("5", "15", *(str(value) for value in range(10, 140, 10)))
_MPH = ("5", "15", *(str(value) for value in range(10, 80, 10)))
_BOARD_MPH = tuple(str(value) for value in range(5, 90, 5))
_SCHOOL_MPH = ("15", "20", "25", "30", "35")
_ZONES = {"GBR": ("20",), "CHE": ("20", "30")}
_ZONES_ELSEWHERE = ("20", "30", "40", "60")
_LED_KMH = ("30", "40", "50", "60", "70", "80", "90", "100", "110", "120", "130")
_LED_MPH = ("20", "30", "40", "50", "60")
_LED_WORDS = ("blank", "lane_closed", "lane_open", "end", "congestion", "slippery")
WET_LANGUAGES = {
    "DEU": ("de",), "AUT": ("de",), "GBR": ("en",), "FRA": ("fr",), "NLD": ("nl",), "POL": ("pl",),
    "CHE": ("de", "fr"), "USA": ("en",),
}  # fmt: skip

_PLATES: dict[str, Face] = {
    "plate:when_wet:drawn": Face(plates.PLATE_M, plates.when_wet_drawn),
    "plate:distance": Face(plates.PLATE_M, plates.words, "400 m"),
    "plate:length": Face(plates.PLATE_M, plates.length, "2 km"),
    "plate:time": Face(plates.PLATE_M, plates.words, "22-6 h"),
    "plate:lorries": Face(plates.PLATE_M, plates.lorries),
    "plate:end": Face(plates.PLATE_M, plates.end),
    **{f"plate:arrow_{way}": Face(plates.PLATE_M, plates.arrow, way) for way in ("left", "right", "ahead")},
}

_COMMON: dict[str, Face] = {
    **_PLATES,
    "stop": Face(_STOP, triangles.stop),
    "yield": Face(_TRIANGLE, triangles.yield_),
    "no_entry": Face(_DISC, discs.no_entry),
    "no_vehicles": Face(_DISC, discs.limit),
    "no_overtaking": Face(_DISC, discs.no_overtaking),
    "ahead_only": Face(_DISC, discs.order, "ahead"),
    "roundabout": Face(_DISC, discs.roundabout),
    **{code: Face(_TRIANGLE, triangles.warning, code) for code in ("children", "roadworks", "slippery")},
    "danger": Face(_TRIANGLE, triangles.danger),
    "town_entry": Face(panels.TOWN_M, panels.town_entry),
    "motorway": Face(panels.MOTORWAY_M, panels.motorway),
    "motorway_end": Face(panels.MOTORWAY_M, panels.motorway_end),
    "info:units": Face(panels.INFO_M, panels.info_units),
    "info:side": Face(panels.INFO_M, panels.info_side),
}

_CONTINENT: dict[str, Face] = {
    "all_end": Face(_DISC, discs.all_end),
    "no_overtaking_end": Face(_DISC, discs.no_overtaking_end),
    "keep_right": Face(_DISC, discs.order, "right"),
    "priority_road": Face(_DIAMOND, triangles.priority_road),
    "priority_road_end": Face(_DIAMOND, triangles.priority_road_end),
    "priority_here": Face(_TRIANGLE, triangles.priority_here),
    "town_exit": Face(panels.TOWN_M, panels.town_exit),
    "crossing": Face((0.6, 0.6), panels.crossing),
    "calm_street": Face((1.0, 0.65), panels.calm_street),
    "one_way": Face(panels.ONE_WAY_M["DEU"], panels.one_way),
}

_BRITAIN: dict[str, Face] = {
    "national": Face(_DISC, discs.national),
    "keep_left": Face(_DISC, discs.order, "left"),
    "crossing": Face(_TRIANGLE, triangles.warning, "crossing"),
    "one_way": Face(panels.ONE_WAY_M["GBR"], panels.one_way),
}


_SWITZERLAND: dict[str, Face] = {
    **_CONTINENT,
    "general:50": Face(panels.ZONE_M, panels.general, "50"),
    "general_end": Face(panels.ZONE_M, panels.general_end, "50"),
}

_AMERICA: dict[str, Face] = {
    **_PLATES,
    **{f"limit:{value}": Face(america.BOARD_M, america.limit, value) for value in _BOARD_MPH},
    **{f"school_limit:{value}": Face(america.SCHOOL_BOARD_M, america.school_limit, value) for value in _SCHOOL_MPH},
    "school_end": Face(america.BOARD_M, america.worded, "END|SCHOOL|ZONE"),
    "school": Face(america.SCHOOL_M, america.school),
    "stop": Face(_STOP, triangles.stop),
    "yield": Face(america.YIELD_M, america.yield_),
    "no_entry": Face(america.SQUARE_M, america.no_entry),
    "no_overtaking": Face(america.BOARD_M, america.worded, "DO|NOT|PASS"),
    "no_overtaking_end": Face(america.BOARD_M, america.worded, "PASS|WITH|CARE"),
    "one_way": Face(america.ONE_WAY_M, america.one_way),
    "keep_right": Face(america.BOARD_M, america.keep_right),
    "ahead_only": Face(america.BOARD_M, america.ahead_only),
    **{
        code: Face(america.DIAMOND_M, america.warning, code)
        for code in ("crossing", "children", "roadworks", "slippery", "roundabout")
    },
    "info:interstate": Face(america.SHIELD_M, america.interstate),
    "plate:advisory": Face(america.ADVISORY_M, america.advisory, "35"),
    **{f"led:{word}": Face(plates.LED_M, plates.led, word) for word in ("blank", "lane_closed", "lane_open")},
}
_OWN = {"GBR": _BRITAIN, "CHE": _SWITZERLAND}


def _numbers(country: str) -> dict[str, Face]:
    values, leds = (_MPH, _LED_MPH) if country == "GBR" else (_KMH, _LED_KMH)
    faces = {f"limit:{value}": Face(_DISC, discs.limit, value) for value in values}
    if country != "GBR":
        faces |= {f"limit_end:{value}": Face(_DISC, discs.limit_end, value) for value in values}
    for value in _ZONES.get(country, _ZONES_ELSEWHERE):
        faces[f"zone:{value}"] = Face(panels.ZONE_M, panels.zone, value)
        faces[f"zone_end:{value}"] = Face(panels.ZONE_M, panels.zone_end, value)
    return faces | {f"led:{value}": Face(plates.LED_M, plates.led, value) for value in (*leds, *_LED_WORDS)}


def _vienna(country: str) -> dict[str, Face]:
    borders = {f"border:{other}": Face(panels.BORDER_M, panels.border, other) for other in BORDERS}
    return {**_COMMON, **_OWN.get(country, _CONTINENT), **_numbers(country), **borders}


def _faces(country: str) -> dict[str, Face]:
    faces = _AMERICA if country == "USA" else _vienna(country)
    tongues = WET_LANGUAGES[country]
    return faces | {f"plate:when_wet:{each}": Face(plates.PLATE_M, plates.when_wet, each) for each in tongues}


FACES: dict[str, dict[str, Face]] = {country: _faces(country) for country in COUNTRIES}
CODES: dict[str, tuple[str, ...]] = {country: tuple(sorted(faces)) for country, faces in FACES.items()}
