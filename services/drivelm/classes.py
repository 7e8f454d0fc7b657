"""What the small reader can say of a crop: one class per whole sign, plate, gantry picture or light state.

The trained network carries its own copy of this order in ``models/reader.json``; the service refuses a network whose
classes it does not know.
"""

OTHER = "other"

LIMIT_VALUES = (10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130)
LED_VALUES = (30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130)

SIGNS: tuple[str, ...] = (
    *(f"limit:{value}" for value in LIMIT_VALUES),
    "no_vehicles",
    "limit_end",
    "all_end",
    "zone:20",
    "zone:30",
    "zone_end",
    "national",
    "stop",
    "yield",
    "priority_road",
    "priority_road_end",
    "priority_here",
    "no_entry",
    "no_overtaking",
    "no_overtaking_end",
    "one_way",
    "keep_left",
    "keep_right",
    "ahead_only",
    "roundabout",
    "crossing",
    "children",
    "roadworks",
    "slippery",
    "danger",
    "calm_street",
    "town_entry:yellow",
    "town_entry:white",
    "town_entry:dark",
    "town_exit:yellow",
    "town_exit:white",
    "town_exit:dark",
    "motorway",
    "motorway_end",
    "border:DEU",
    "border:GBR",
    "border:AUT",
    "border:FRA",
    "border:NLD",
    "border:POL",
    "info:units_mph",
    "info:units_kmh",
    "info:side_left",
    "info:side_right",
)
PLATES: tuple[str, ...] = (
    "plate:when_wet:de",
    "plate:when_wet:en",
    "plate:when_wet:fr",
    "plate:when_wet:nl",
    "plate:when_wet:drawn",
    "plate:distance",
    "plate:time",
    "plate:lorries",
    "plate:end",
)
PANELS: tuple[str, ...] = (
    *(f"led:{value}" for value in LED_VALUES),
    "led:blank",
    "led:lane_closed",
    "led:lane_open",
    "led:end",
    "led:congestion",
    "led:slippery",
)
LIGHTS: tuple[str, ...] = ("light:red", "light:red_amber", "light:amber", "light:green", "light:off")

READER_CLASSES: tuple[str, ...] = (OTHER, *SIGNS, *PLATES, *PANELS, *LIGHTS)

# Which classes make sense for a box of each kind; everything else is set aside before the scores are normalised.
BY_KIND: dict[str, tuple[str, ...]] = {
    "sign": (OTHER, *SIGNS, *PLATES, *PANELS),
    "plate": (OTHER, *PLATES),
    "panel": (OTHER, *PANELS, *SIGNS),
    "light": (OTHER, *LIGHTS),
}
