"""The belief about the country, by its signs: cues add up, and a change of belief needs clear evidence (hysteresis)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from proto.perception import Track
from services.drivelm.vocabulary.jurisdictions import JURISDICTIONS, ON_BOARDS, Jurisdiction
from services.drivelm.vocabulary.text import number_in

TAKE_OVER = 0.85
"""Posterior that another country must reach to replace the one believed."""
KEEP_ABOVE = 0.35
"""Below this posterior the believed country is given up even without a successor."""
_CAP = 7.0
_REMEMBERED = 256
_BORDER = 6.0
_HOME = 0.816
"""Posterior of the home setting before anything was seen."""
_TOLD_BY_SIGNS = 0.5
"""Posterior that signs alone, without the home setting, must give the country before it counts as told."""
_SIDE_CUE = 0.5
POSITION = "position"
"""Code of the evidence that is a position on earth."""

_TOLD = 0.05
_MOST_TOLD = 6

Cues = Mapping[str, float]
Evidence = tuple[tuple[str, float], ...]
"""What spoke for a country, the weightiest first: code of a sign, plate or board (`oncoming`: traffic), and log-odds."""


def _all(side: str, amount: float) -> Cues:
    return {country: amount for country, row in JURISDICTIONS.items() if row.side == side}


def _unit(unit: str, amount: float) -> Cues:
    return {country: amount for country, row in JURISDICTIONS.items() if row.unit == unit}


def _town(ground: str) -> Cues:
    return {country: 2.0 for country, row in JURISDICTIONS.items() if row.town_ground == ground}


def _language(language: str) -> Cues:
    return {country: 2.0 for country, row in JURISDICTIONS.items() if language in row.plate_languages}


def _with_boards(amount: float) -> Cues:
    return {country: amount for country, row in JURISDICTIONS.items() if row.boards}


_BY_SIGNS = tuple(country for country, row in JURISDICTIONS.items() if row.by_signs)
_CONTINENTAL = {country: 1.5 for country, row in JURISDICTIONS.items() if row.side == "right" and not row.boards}
_TABLE: dict[str, Cues] = {
    **{f"town_{way}:{ground}": _town(ground) for way in ("entry", "exit") for ground in ("yellow", "white", "dark")},
    **{f"plate:when_wet:{language}": _language(language) for language in ("de", "en", "fr", "nl", "pl")},
    "national": {"GBR": 3.0, "IRL": 3.0},
    "general:50": {"CHE": 3.0},
    "general_end": {"CHE": 3.0},
    "school": _with_boards(2.5),
    "school_end": _with_boards(2.5),
    "plate:advisory": _with_boards(2.0),
    "info:interstate": _with_boards(3.0),
    "diamond:yellow": {**_with_boards(2.5), "IRL": 2.5},
    "keep_left": _all("left", 2.5),
    "keep_right": _all("right", 2.5),
    "info:units_mph": _unit("mph", 4.0),
    "info:units_kmh": _unit("km/h", 4.0),
    "info:side_left": _all("left", 4.0),
    "info:side_right": _all("right", 4.0),
    "all_end": {**_CONTINENTAL, "IRL": 1.5},
    "limit_end": _CONTINENTAL,
    "priority_road": _CONTINENTAL,
    "no_overtaking_end": _CONTINENTAL,
}


def cues_of(reading: str) -> Cues:
    """What a believed sign says about the country, in log-odds per country; a border sign is treated apart."""
    head, _, tail = reading.partition(":")
    if reading in _TABLE:
        return _TABLE[reading]
    if head in _NUMBERS and (value := number_in(tail)) is not None:
        return {country: cue for country, row in JURISDICTIONS.items() if (cue := _of_number(row, head, value))}
    return {}


_NUMBERS = frozenset({"limit", "zone", "led", "limit_board", "school_limit"})
_OFF_LIST, _OTHER_STYLE = -1.0, -2.0


def _of_number(row: Jurisdiction, head: str, value: int) -> float:
    """A number that the country does not post speaks against it, and so does the other style of sign."""
    off_list = _OFF_LIST if value not in row.limits else 0.0
    other_style = _OTHER_STYLE if head != "led" and row.boards != (head in ON_BOARDS) else 0.0
    return off_list + other_style


class Switch(NamedTuple):
    """The last change of mind: from which country (None: from none), and on what evidence."""

    former: str | None
    evidence: Evidence


@dataclass(frozen=True, slots=True, kw_only=True)
class CountryBelief:
    """The belief about the country: log-scores, and the one believed now with its confidence."""

    scores: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(_BY_SIGNS, 0.0))
    believed: str | None = None
    counted: tuple[tuple[str, int], ...] = ()
    """Tracks whose cue is in already: each sign counts once."""
    since: Mapping[str, Cues] = field(default_factory=dict)
    """Code to its cues, added up since the last change of mind."""
    switch: Switch | None = None
    last: str | None = None
    """The country believed before it was given up without a successor."""

    placed: bool = False
    """A position on earth has told the country."""
    elsewhere: str = ""
    """A country whose signs are not known here, told by the position; empty: none was."""

    @property
    def assumed(self) -> bool:
        """Whether it is the home setting, and neither a position nor what was seen tells it: what many countries share does not."""
        if self.believed is None or self.placed or self.switch is not None:
            return False
        seen = {each: sum(cues.get(each, 0.0) for cues in self.since.values()) for each in self.scores}
        return _share(seen, {self.believed}) < _TOLD_BY_SIGNS

    @classmethod
    def at_home(cls, country: str) -> "CountryBelief":
        """Start from a home setting: a weak prior that a single strong cue outweighs; empty: know nothing."""
        if country not in JURISDICTIONS:
            return cls()
        scores = dict.fromkeys(_BY_SIGNS, 0.0)
        others = len(scores) - (country in scores)
        scores[country] = math.log(_HOME * others / (1.0 - _HOME))
        return cls(scores=scores, believed=country)

    def posterior(self, country: str | None) -> float:
        """How probable a country is."""
        return self._share({country}) if country is not None and country in self.scores else 0.0

    def of_unit(self, unit: str) -> float:
        """How probable it is that signs speak in this unit."""
        return self._share({country for country, row in JURISDICTIONS.items() if row.unit == unit})

    def of_side(self, side: str) -> float:
        """How probable it is that traffic keeps to this side."""
        return self._share({country for country, row in JURISDICTIONS.items() if row.side == side})

    @property
    def evidence(self) -> Evidence:
        """On what the country is believed: what made it replace another one; else what has spoken for it so far."""
        if self.switch is not None:
            return self.switch.evidence
        return _evidence(self.since, self.believed, None) if self.believed is not None else ()

    def with_cue(self, key: tuple[str, int], cues: Cues, code: str = "", *, passed: bool = True) -> "CountryBelief":
        """With a cue from a track, of the sign `code`; a track already counted changes nothing, nor does any cue in a country whose
        signs are not known here: there it would speak for a country that merely looks alike. What was not surely passed may
        put the home setting in doubt, and tells no country."""
        if key in self.counted or not cues or self.elsewhere or not (passed or self.assumed):
            return self
        scores = {country: score + cues.get(country, 0.0) for country, score in self.scores.items()}
        counted, since = (*self.counted, key)[-_REMEMBERED:], {**self.since, code: _sum(self.since.get(code, {}), cues)}
        return replace(self, scores=_levelled(scores), counted=counted, since=since)._decided(passed=passed)

    def past_border(self, key: tuple[str, int], country: str) -> "CountryBelief":
        """A believed border sign was passed: that country, whatever was believed before."""
        if key in self.counted or country not in JURISDICTIONS:
            return self
        scores = {**dict.fromkeys(_BY_SIGNS, 0.0), country: _BORDER}
        passed = replace(self, scores=scores, counted=(*self.counted, key)[-_REMEMBERED:])
        if country == self.believed:
            return replace(passed, since={f"border:{country}": {country: _BORDER}})
        return passed._switched(country, ((f"border:{country}", _BORDER),))

    def at_position(self, country: str) -> "CountryBelief":
        """A position deep inside a country: that country; without one whose signs are known here, none is believed."""
        if country == (self.believed or self.elsewhere) and self.placed:
            return self
        scores = dict.fromkeys(_BY_SIGNS, 0.0)
        if country not in JURISDICTIONS:
            last = self.believed or self.last
            return replace(self, scores=scores, believed=None, last=last, placed=True, elsewhere=country)
        scores[country] = _BORDER
        placed = replace(self, scores=scores, placed=True, elsewhere="")
        return placed if country == self.believed else placed._switched(country, ((POSITION, _BORDER),))

    def _decided(self, *, passed: bool) -> "CountryBelief":
        best = max(self.scores, key=lambda country: (self.scores[country], country))
        if passed and best != self.believed and self.posterior(best) >= TAKE_OVER:
            return self._switched(best, _evidence(self.since, best, self.believed or self.last))
        if self.believed is not None and self.posterior(self.believed) < KEEP_ABOVE:
            return replace(self, believed=None, last=self.believed)
        return self

    def _switched(self, country: str, evidence: Evidence) -> "CountryBelief":
        former = self.believed or self.last
        return replace(self, believed=country, last=None, elsewhere="", since={}, switch=Switch(former, evidence))

    def _share(self, countries: set[str]) -> float:
        return _share(self.scores, countries)


def _share(scores: Mapping[str, float], countries: set[str]) -> float:
    top = max(scores.values())
    masses = {country: math.exp(score - top) for country, score in scores.items()}
    return sum(mass for country, mass in masses.items() if country in countries) / sum(masses.values())


def _sum(before: Cues, cues: Cues) -> Cues:
    return {country: before.get(country, 0.0) + cues.get(country, 0.0) for country in {**before, **cues}}


def _evidence(since: Mapping[str, Cues], country: str, former: str | None) -> Evidence:
    """What speaks for a country more than for the former one; without one, more than for the average of the others."""
    others = [former] if former not in (None, country) else [each for each in _BY_SIGNS if each != country]
    gains = {
        code: cues.get(country, 0.0) - sum(cues.get(other or "", 0.0) for other in others) / len(others)
        for code, cues in since.items()
    }
    told = sorted(((gain, code) for code, gain in gains.items() if code and gain >= _TOLD), reverse=True)
    return tuple((code, min(gain, _CAP)) for gain, code in told[:_MOST_TOLD])


COMES_MPS = -2.0
"""Over ground, along our axis: what is slower may stand, and be parked on either side."""
OPPOSITE = 0.05
"""Sideways by forwards of a vehicle that comes straight against us. In a bend of any radius R such a vehicle is nearer than 0.05 R, and
there its own side of the road is still on its own side of our axis."""


def seen_to_come(track: Track, ego_mps: float | None) -> bool:
    """Whether a vehicle surely drives against us on a straight road, by its own motion: what a map says of its lane, or where it is
    while the road bends, tells nothing of the side on which traffic keeps."""
    if ego_mps is None or track.kind != "vehicle" or track.age_s <= 1.0 or track.confidence <= 0.7:
        return False
    over_ground_mps = track.vx_mps + ego_mps
    return over_ground_mps < COMES_MPS and abs(track.vy_mps) <= OPPOSITE * -over_ground_mps


def oncoming_cue(lateral_m: float) -> Cues:
    """An oncoming vehicle well to one side of the ego's path tells on which side traffic keeps."""
    if abs(lateral_m) < 1.5:
        return {}
    return _all("right" if lateral_m > 0 else "left", _SIDE_CUE)


def _levelled(scores: Mapping[str, float]) -> dict[str, float]:
    """The best at 0 and no other further behind than the cap: old certainty can always be overcome by new cues."""
    top = max(scores.values())
    return {country: max(score - top, -_CAP) for country, score in scores.items()}
