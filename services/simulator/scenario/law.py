"""The limit that is really in force along the route, from the signs that the scenario places. Truth only: the driver does not know it.

Statutory speeds outside signs: DEU § 3 StVO, GBR Highway Code rule 124; the others likewise from their codes.
"""

from dataclasses import dataclass

import msgspec
from msgspec.structs import replace

from domain.units import MPS_PER
from services.simulator.scenario.load import sign_country
from services.simulator.scenario.plan import RoadClass, Scenario

KMH, MPH = MPS_PER["km/h"], MPS_PER["mph"]
_DEFAULTS: dict[str, dict[RoadClass, float | None]] = {
    "DEU": {"urban": 50 * KMH, "rural": 100 * KMH, "motorway": None},
    "GBR": {"urban": 30 * MPH, "rural": 60 * MPH, "motorway": 70 * MPH},
    "AUT": {"urban": 50 * KMH, "rural": 100 * KMH, "motorway": 130 * KMH},
    "FRA": {"urban": 50 * KMH, "rural": 80 * KMH, "motorway": 130 * KMH},
    "NLD": {"urban": 50 * KMH, "rural": 80 * KMH, "motorway": 100 * KMH},
    "POL": {"urban": 50 * KMH, "rural": 90 * KMH, "motorway": 140 * KMH},
}
WITHOUT_WET_LIMITS = frozenset({"GBR"})
"""Where a plate about rain is a warning (TSRGD 2016 has no limit that depends on wet weather): the number always holds."""


class Legal(msgspec.Struct, frozen=True, kw_only=True):
    """The law at a place: limits in m/s; None: no limit."""

    country: str
    road_class: RoadClass
    stretch_mps: float | None = None
    wet_mps: float | None = None
    zone_mps: float | None = None
    gantry_mps: float | None = None

    def limit_mps(self, wet: bool) -> float | None:
        """The limit in force; a gantry stands above a fixed sign, a condition that holds is kept as well."""
        fixed = self.gantry_mps if self.gantry_mps is not None else self.stretch_mps
        posted = [limit for limit in (fixed, self.zone_mps, self.wet_mps if wet else None) if limit is not None]
        return min(posted) if posted else _DEFAULTS[self.country][self.road_class]


@dataclass(frozen=True, slots=True)
class Post:
    """A post along the route, as the law reads it; a gantry's codes are what it shows when passed."""

    at_m: float
    country: str
    codes: tuple[str, ...]
    ordinal: int = -1
    """The gantry's number; -1 is a fixed sign."""


@dataclass(frozen=True, slots=True)
class Law:
    """Start, posts in driving order, and the built-up classes of the stretches."""

    start: Legal
    posts: tuple[Post, ...]
    stretches: tuple[tuple[float, RoadClass], ...]

    def at(self, s_m: float, panels: dict[int, str]) -> Legal:
        """The law at s, when the gantries (by number) show or showed `panels`."""
        legal = self.start
        for post in self.posts:
            if post.at_m > s_m:
                break
            codes = post.codes if post.ordinal < 0 else (panels.get(post.ordinal, ""),)
            legal = read_post(legal, post.country, codes, self.class_at(post.at_m))
        return legal

    def class_at(self, s_m: float) -> RoadClass:
        """The road class of the stretch at s."""
        return [road_class for from_m, road_class in self.stretches if from_m <= s_m][-1]


def build_law(scenario: Scenario) -> Law:
    """The law of a scenario."""
    stretches = tuple((stretch.from_m, stretch.road_class) for stretch in scenario.road.stretches)
    fixed = [Post(sign.at_m, sign_country(scenario, sign.at_m, sign.country), sign.codes) for sign in scenario.signs]
    gantries = [
        Post(gantry.at_m, sign_country(scenario, gantry.at_m, None), (), ordinal)
        for ordinal, gantry in enumerate(scenario.gantries)
    ]
    posts = tuple(sorted(fixed + gantries, key=lambda post: post.at_m))
    return Law(Legal(country=scenario.country, road_class=stretches[0][1]), posts, stretches)


def read_post(legal: Legal, country: str, codes: tuple[str, ...], road_class: RoadClass) -> Legal:
    """The law behind a post."""
    for index, code in enumerate(codes):
        plate = codes[index + 1] if index + 1 < len(codes) else ""
        legal = _read(legal, country, code, plate, road_class)
    return legal


def speed_mps(country: str, number: str) -> float:
    """A posted number in m/s."""
    return float(number) * (MPH if country == "GBR" else KMH)


def _read(legal: Legal, country: str, code: str, plate: str, road_class: RoadClass) -> Legal:
    word, _, number = code.partition(":")
    match word:
        case "limit":
            return _limit(legal, speed_mps(country, number), plate)
        case "led":
            return replace(legal, gantry_mps=speed_mps(country, number) if number.isdigit() else _led(legal, number))
        case "zone":
            return replace(legal, zone_mps=speed_mps(country, number), stretch_mps=None)
        case "zone_end":
            return replace(legal, zone_mps=None)
        case "limit_end" | "all_end":
            return replace(legal, stretch_mps=None, wet_mps=None, gantry_mps=None)
        case "border":
            return Legal(country=number, road_class=road_class)
        case "national":
            return Legal(country=legal.country, road_class="rural" if road_class == "urban" else road_class)
    return _place(legal, word)


def _limit(legal: Legal, limit_mps: float, plate: str) -> Legal:
    if plate.startswith("plate:when_wet") and legal.country not in WITHOUT_WET_LIMITS:
        return replace(legal, wet_mps=limit_mps)
    # These plates do not bind a driver who goes on.
    if plate in ("plate:lorries", "plate:time", "plate:arrow_left", "plate:arrow_right"):
        return legal
    if plate == "plate:end":
        return replace(legal, stretch_mps=None)
    return replace(legal, stretch_mps=limit_mps)


def _led(legal: Legal, word: str) -> float | None:
    return None if word in ("end", "blank", "") else legal.gantry_mps


_CLASSES: dict[str, RoadClass] = {
    "town_entry": "urban", "town_exit": "rural", "motorway": "motorway", "motorway_end": "rural",
}  # fmt: skip


def _place(legal: Legal, word: str) -> Legal:
    return Legal(country=legal.country, road_class=_CLASSES[word]) if word in _CLASSES else legal
