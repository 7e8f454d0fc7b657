"""Outcomes of populations as a table. Pure."""

from collections.abc import Iterator, Sequence
from statistics import fmean
from typing import Any, Literal

import msgspec

from evaluation.campaign.pages import csv_text
from evaluation.population.outcome import Contact, Outcome
from evaluation.statistics import poisson_ci
from services.simulator.driver.kinds import DriverKind

Where = Literal["windows", "routes"]
WITHIN_S = 10.0
"""An intervention was needed if the driver, left alone from its beginning, hits a road user within so long."""
AVOIDS, HALVES = 0.8, 0.5


class Driven(msgspec.Struct, frozen=True, kw_only=True):
    """A run with the grant, and for each of its interventions the same run left alone from there on."""

    granted: Outcome
    alone: tuple[Outcome, ...] = ()


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """A population at windows or on routes. Speeds in km/h; None: nothing of the kind happened."""

    population: DriverKind
    method: str
    where: Where
    runs: int
    missing: int
    km: float
    hit_alone: int
    """Runs in which the driver alone hits a road user; 0 for routes, where it is not known."""
    hit: int
    """Runs with the grant in which a road user is hit."""
    contact_alone_kmh: float | None
    """Mean over the runs in which the driver alone hits a road user."""
    contact_kmh: float | None
    """Over the same runs with the grant; a run without a collision counts as 0."""
    hit_behind: int
    """Runs with the grant in which a road user drives into the car from behind."""
    interventions: int
    needed: int
    unneeded_per_1000_km: float | None
    unneeded_low: float | None
    unneeded_high: float | None
    verdict: str


def is_needed(started_s: float, alone: Outcome) -> bool:
    """Whether the driver, left alone from the intervention's beginning, hits a road user soon."""
    return any(started_s <= each.time_s <= started_s + WITHIN_S for each in _ahead(alone))


def row_of(population: DriverKind, method: str, where: Where, driven: Sequence[Driven], missing: int) -> Row:
    """The row of its runs."""
    hit = [bool(_ahead(each.granted)) for each in driven]
    alone = [_alone(each) for each in driven] if where == "windows" else []
    pairs = [(_kmh(one), _kmh(each.granted)) for one, each in zip(alone, driven, strict=False) if _ahead(one)]
    judged = [is_needed(*pair) for each in driven for pair in zip(each.granted.interventions, each.alone, strict=True)]
    km = sum(each.granted.km for each in driven)
    rate = poisson_ci(judged.count(False), km, per=1000.0) if where == "routes" else None
    row = Row(
        population=population,
        method=method,
        where=where,
        runs=len(driven),
        missing=missing,
        km=round(km, 2),
        hit_alone=len(pairs),
        hit=sum(hit),
        contact_alone_kmh=round(fmean(one for one, _ in pairs), 1) if pairs else None,
        contact_kmh=round(fmean(two for _, two in pairs), 1) if pairs else None,
        hit_behind=sum(any(contact.behind for contact in each.granted.contacts) for each in driven),
        interventions=len(judged),
        needed=sum(judged),
        unneeded_per_1000_km=_rounded(rate.value if rate is not None else None),
        unneeded_low=_rounded(rate.low if rate is not None else None),
        unneeded_high=_rounded(rate.high if rate is not None else None),
        verdict="",
    )
    return msgspec.structs.replace(row, verdict=verdict(row, sum(_avoids(one, two) for one, two in pairs)))


def _avoids(alone_kmh: float, granted_kmh: float) -> bool:
    return alone_kmh > 0.0 and granted_kmh == 0.0


def _alone(driven: Driven) -> Outcome:
    """Without an intervention the driver was alone."""
    return driven.alone[0] if driven.alone else driven.granted


def _ahead(outcome: Outcome) -> tuple[Contact, ...]:
    return tuple(each for each in outcome.contacts if not each.behind)


def _kmh(outcome: Outcome) -> float:
    return max((each.kmh for each in _ahead(outcome)), default=0.0)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 1)


def verdict(row: Row, avoided: int) -> str:
    """`holds`, or what does not; empty where nothing is asked, or too little was driven to say."""
    unneeded = row.interventions - row.needed
    if row.population == "attentive":
        return f"{unneeded} not needed" if unneeded else "holds"
    if row.where == "routes" or not row.hit_alone:
        return ""
    if row.population == "absent":
        told = f"{avoided} of {row.hit_alone} avoided"
        return "holds" if avoided >= AVOIDS * row.hit_alone else told
    halved = (row.contact_kmh or 0.0) <= HALVES * (row.contact_alone_kmh or 0.0)
    return "holds" if halved else "contact speed not halved"


TITLES = (
    "driver", "method", "at", "runs", "missing", "km", "hit alone", "hit with grant", "contact alone, mean km/h", "with grant",
    "hit from behind", "interventions", "needed", "not needed per 1,000 km", "low", "high", "verdict",
)  # fmt: skip


def shown(row: Row) -> Iterator[str]:
    """A row's texts, in the order of `TITLES`."""
    for value in msgspec.structs.astuple(row):
        yield "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def as_csv(rows: Sequence[Row]) -> str:
    """All fields of all rows."""
    return csv_text((msgspec.structs.asdict(row) for row in rows), Row.__struct_fields__)


def values(rows: Sequence[Row]) -> dict[str, Any]:
    """What the page shows."""
    return {"titles": TITLES, "rows": [list(shown(row)) for row in rows]}
