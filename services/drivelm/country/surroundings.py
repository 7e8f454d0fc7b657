"""What is believed of country, units, traffic side and kind of road, as facts."""

from typing import get_args

import msgspec

from proto.scene import Candidate, Fact, FactKind, Unit
from services.drivelm.country.country_belief import POSITION, CountryBelief
from services.drivelm.vocabulary.jurisdictions import JURISDICTIONS, Side

BELIEVE = 0.8
_MENTION = 0.05
SURE = 0.99
"""Of a position's country without signs that are known here: it leaves the country unknown."""


def surroundings(where: CountryBelief, road_type: tuple[str, float] | None, now_ns: int) -> tuple[Fact, ...]:
    """One fact each; a doubtful one carries its candidates and is not believed. Nothing known, nothing said."""
    facts = []
    if where.believed is not None:
        countries = {country: where.posterior(country) for country in JURISDICTIONS}
        country = _fact("jurisdiction", where.believed, countries, now_ns, assumed=where.assumed)
        facts.append(_with_evidence(country, where))
        facts.append(_best("units", {unit: where.of_unit(unit) for unit in get_args(Unit)}, now_ns))
        facts.append(_best("traffic_side", {side: where.of_side(side) for side in get_args(Side)}, now_ns))
    elif where.elsewhere:
        facts.append(_fact("jurisdiction", where.elsewhere, {where.elsewhere: SURE}, now_ns))
    elif where.last is not None:
        facts.append(_given_up(where, where.last, now_ns))
    if road_type is not None:
        facts.append(_fact("road_type", road_type[0], {road_type[0]: road_type[1]}, now_ns))
    return tuple(facts)


def _given_up(where: CountryBelief, former: str, now_ns: int) -> Fact:
    """That the former country is believed no more, by the best other one as a doubt."""
    others = {country: where.posterior(country) for country in JURISDICTIONS if country != former}
    best = _best("jurisdiction", others, now_ns)
    told = f"The signs speak against {former}; which country it is, is open."
    doubted = (Candidate(reading=best.reading, confidence=best.confidence),)
    return msgspec.structs.replace(best, believed=False, candidates=doubted, sentence=told)


def _with_evidence(country: Fact, where: CountryBelief) -> Fact:
    """With what the country is believed on, as codes with log-odds, and in a sentence."""
    told = ", ".join(f"{code} {weight:.1f}" for code, weight in where.evidence)
    if where.assumed:
        return msgspec.structs.replace(
            country, sentence=f"{country.reading} is the home setting; no sign has told yet."
        )
    former = where.switch.former if where.switch is not None else None
    changed = f", no longer of {former}" if former not in (None, country.reading) else ""
    sentence = f"The signs are of {country.reading}{changed}; for it spoke: {told or 'nothing'}."
    if told.startswith(POSITION):
        sentence = f"The position lies in {country.reading}{changed}."
    return msgspec.structs.replace(country, text=told, sentence=sentence)


def _best(kind: FactKind, shares: dict[str, float], now_ns: int) -> Fact:
    return _fact(kind, max(shares, key=lambda name: shares[name]), shares, now_ns)


def _fact(kind: FactKind, reading: str, shares: dict[str, float], now_ns: int, *, assumed: bool = False) -> Fact:
    believed = shares[reading] >= BELIEVE
    rest = sorted(((share, name) for name, share in shares.items() if share >= _MENTION), reverse=True)
    return Fact(
        kind=kind,
        reading=reading,
        confidence=round(shares[reading], 4),
        frame_stamp_ns=now_ns,
        track_id=0,
        believed=believed,
        assumed=assumed,
        candidates=() if believed else tuple(Candidate(reading=n, confidence=round(s, 4)) for s, n in rest),
    )
