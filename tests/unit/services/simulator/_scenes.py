"""Small scenarios for tests: a straight road, and what a test adds to it."""

from services.simulator.scenario.load import parse_scenario
from services.simulator.scenario.plan import Scenario

_STRAIGHT = """
name = "test"
country = "{country}"
driver_language = "{language}"
driver_country = "GBR"
duration_s = 30
{top}
[road]
lanes = {lanes}
{road}
bends = [{{ length_m = {length} }}]
stretches = [{{ from_m = 0, road_class = "{road_class}", surroundings = "fields" }}]
[ego]
at_m = 20
speed_kmh = {speed}
[traffic]
forward = 0
oncoming = 0
[[weather]]
at_s = 0
rain_mm_h = {rain}
visibility_m = 5000
{rest}
"""


def scenario_text(
    *,
    rest: str = "",
    road: str = "",
    top: str = "",
    country: str = "DEU",
    language: str = "de",
    lanes: int = 1,
    length: float = 1200,
    road_class: str = "rural",
    speed: float = 70,
    rain: float = 0,
) -> str:
    """The text of a scenario with a straight road and no traffic."""
    values = {"top": top, "rest": rest, "road": road, "country": country, "language": language}
    return _STRAIGHT.format(**values, lanes=lanes, length=length, road_class=road_class, speed=speed, rain=rain)


def scenario(
    *,
    rest: str = "",
    road: str = "",
    country: str = "DEU",
    language: str = "de",
    lanes: int = 1,
    length: float = 1200,
    road_class: str = "rural",
    speed: float = 70,
    rain: float = 0,
) -> Scenario:
    """The same, read."""
    text = scenario_text(
        rest=rest,
        road=road,
        country=country,
        language=language,
        lanes=lanes,
        length=length,
        road_class=road_class,
        speed=speed,
        rain=rain,
    )
    return parse_scenario(text, "test.toml")
