"""What the small reader can say of a crop: one class per whole sign, plate, gantry picture or light state.

The trained network carries its own copy of this order in ``models/reader.json``; the service refuses a network whose
classes it does not know.
"""

OTHER = "other"

LIMIT_VALUES = (5, 10, 15, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130)
LED_VALUES = (20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130)
BOARD_VALUES = tuple(range(5, 90, 5))
"""On the boards of the United States, mph."""
SCHOOL_VALUES = (15, 20, 25, 30, 35)
ZONE_VALUES = (20, 30, 40, 60)

SIGNS: tuple[str, ...] = (
    *(f"limit:{value}" for value in LIMIT_VALUES),
    *(f"limit_board:{value}" for value in BOARD_VALUES),
    *(f"school_limit:{value}" for value in SCHOOL_VALUES),
    "school_end",
    "general:50",
    "general_end",
    "no_vehicles",
    "limit_end",
    "all_end",
    *(f"zone:{value}" for value in ZONE_VALUES),
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
    "school",
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
    "border:CHE",
    "info:units_mph",
    "info:units_kmh",
    "info:side_left",
    "info:side_right",
    "info:interstate",
)
PLATES: tuple[str, ...] = (
    "plate:when_wet:de",
    "plate:when_wet:en",
    "plate:when_wet:fr",
    "plate:when_wet:nl",
    "plate:when_wet:pl",
    "plate:when_wet:drawn",
    "plate:distance",
    "plate:length",
    "plate:time",
    "plate:lorries",
    "plate:end",
    "plate:advisory",
    "plate:arrow_left",
    "plate:arrow_right",
    "plate:arrow_ahead",
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
ROUND_LIGHTS: tuple[str, ...] = ("light:red", "light:red_amber", "light:amber", "light:green", "light:off")
ARROW_LIGHTS: tuple[str, ...] = tuple(
    f"light:{colour}_{way}" for colour in ("red", "amber", "green") for way in ("left", "straight", "right")
)
LIGHTS: tuple[str, ...] = (*ROUND_LIGHTS, *ARROW_LIGHTS)

READER_CLASSES: tuple[str, ...] = (OTHER, *SIGNS, *PLATES, *PANELS, *LIGHTS)

# Which classes make sense for a box of each kind; everything else is set aside before the scores are normalised.
BY_KIND: dict[str, tuple[str, ...]] = {
    "sign": (OTHER, *SIGNS, *PLATES, *PANELS),
    "plate": (OTHER, *PLATES),
    "panel": (OTHER, *PANELS, *SIGNS),
    "light": (OTHER, *LIGHTS),
}
