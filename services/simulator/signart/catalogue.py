"""Every face we can draw: code, size and painter, per country."""

from collections.abc import Callable
from typing import NamedTuple

from services.simulator.signart import discs, panels, plates, triangles
from services.simulator.signart.painter import Painter
from services.simulator.signart.sheet import Sheet

Draw = Callable[[Painter, Sheet, str], None]
Size = tuple[float, float]

COUNTRIES = ("DEU", "GBR", "AUT", "FRA", "NLD", "POL")


class Face(NamedTuple):
    """How one code is drawn: its size in metres, its painter, and what stands after the code's colon."""

    size_m: Size
    draw: Draw
    argument: str = ""


_DISC: Size = (discs.DISC_M, discs.DISC_M)
_TRIANGLE: Size = (triangles.SIDE_M, triangles.HEIGHT_M)
_STOP: Size = (triangles.STOP_M, triangles.STOP_M)
_DIAMOND: Size = (triangles.DIAMOND_M, triangles.DIAMOND_M)

_KMH = tuple(str(value) for value in range(10, 140, 10))
_MPH = tuple(str(value) for value in range(10, 80, 10))
_LED_KMH = ("40", "50", "60", "70", "80", "90", "100", "110", "120", "130")
_LED_MPH = ("30", "40", "50", "60")
_LED_WORDS = ("blank", "lane_closed", "lane_open", "end", "congestion", "slippery")
WET_LANGUAGE = {"DEU": "de", "AUT": "de", "GBR": "en", "FRA": "fr", "NLD": "nl", "POL": ""}

_COMMON: dict[str, Face] = {
    "stop": Face(_STOP, triangles.stop),
    "yield": Face(_TRIANGLE, triangles.yield_),
    "no_entry": Face(_DISC, discs.no_entry),
    "no_vehicles": Face(_DISC, discs.limit),
    "no_overtaking": Face(_DISC, discs.no_overtaking),
    "ahead_only": Face(_DISC, discs.ahead_only),
    "roundabout": Face(_DISC, discs.roundabout),
    "children": Face(_TRIANGLE, triangles.children),
    "roadworks": Face(_TRIANGLE, triangles.roadworks),
    "slippery": Face(_TRIANGLE, triangles.slippery),
    "danger": Face(_TRIANGLE, triangles.danger),
    "town_entry": Face(panels.TOWN_M, panels.town_entry),
    "motorway": Face(panels.MOTORWAY_M, panels.motorway),
    "motorway_end": Face(panels.MOTORWAY_M, panels.motorway_end),
    "info:units": Face(panels.INFO_M, panels.info_units),
    "info:side": Face(panels.INFO_M, panels.info_side),
    "plate:when_wet:drawn": Face(plates.PLATE_M, plates.when_wet_drawn),
    "plate:distance": Face(plates.PLATE_M, plates.words, "400 m"),
    "plate:time": Face(plates.PLATE_M, plates.words, "22-6 h"),
    "plate:lorries": Face(plates.PLATE_M, plates.lorries),
    "plate:end": Face(plates.PLATE_M, plates.end),
}

_CONTINENT: dict[str, Face] = {
    "all_end": Face(_DISC, discs.all_end),
    "no_overtaking_end": Face(_DISC, discs.no_overtaking_end),
    "keep_right": Face(_DISC, discs.keep_right),
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
    "keep_left": Face(_DISC, discs.keep_left),
    "crossing": Face(_TRIANGLE, triangles.crossing_ahead),
    "one_way": Face(panels.ONE_WAY_M["GBR"], panels.one_way),
}


def _numbers(country: str) -> dict[str, Face]:
    values, leds = (_MPH, _LED_MPH) if country == "GBR" else (_KMH, _LED_KMH)
    faces = {f"limit:{value}": Face(_DISC, discs.limit, value) for value in values}
    if country != "GBR":
        faces |= {f"limit_end:{value}": Face(_DISC, discs.limit_end, value) for value in values}
    for value in ("20",) if country == "GBR" else ("20", "30"):
        faces[f"zone:{value}"] = Face(panels.ZONE_M, panels.zone, value)
        faces[f"zone_end:{value}"] = Face(panels.ZONE_M, panels.zone_end, value)
    return faces | {f"led:{value}": Face(plates.LED_M, plates.led, value) for value in (*leds, *_LED_WORDS)}


def _faces(country: str) -> dict[str, Face]:
    own = _BRITAIN if country == "GBR" else _CONTINENT
    faces = {**_COMMON, **own, **_numbers(country)}
    faces |= {f"border:{other}": Face(panels.BORDER_M, panels.border, other) for other in COUNTRIES}
    if language := WET_LANGUAGE[country]:
        faces[f"plate:when_wet:{language}"] = Face(plates.PLATE_M, plates.when_wet, language)
    return faces


FACES: dict[str, dict[str, Face]] = {country: _faces(country) for country in COUNTRIES}
CODES: dict[str, tuple[str, ...]] = {country: tuple(sorted(faces)) for country, faces in FACES.items()}
