"""The key facts as they truly are: country, limit in force, signs ahead, where to stop, the light."""

from collections.abc import Iterator

from domain.units import from_mps
from proto import topics
from proto.scene import Fact, FactKind, Facts, Scope, Unit
from proto.truth import Truth
from services.drivelm.reading.facts import public_code
from services.drivelm.vocabulary.jurisdictions import JURISDICTIONS
from services.drivelm.vocabulary.parser import statement_of

BACKEND = "truth"
AGAIN_NS = 200_000_000
"""How often all is said again; a change of the limit in force is said at once."""
ASIDE_M = 14.0
FIRST_ID = 3_000_000_000
"""Numbers of the law's own changes, and of stops; signs have those of their posts."""
STOP_ID, LIGHT_ID = FIRST_ID - 1, FIRST_ID - 2
HALF_EGO_M = 2.25
ENDS = ("all_end", "zone_end", "led:blank")
STOPS = {"stop_sign": "stop", "yield": "yield"}


Law = tuple[float | None, str]
"""The limit in force in m/s (`None`: no limit), and the jurisdiction whose law it is."""


class TrueFacts:
    """Says what is so; the front end's own facts do not leave."""

    topic = topics.FACTS

    def __init__(self) -> None:
        self._said_ns: int | None = None
        self._law: Law | None = None
        self._changes = 0

    def instead(self, message: Facts, stamp_ns: int) -> None:
        """Nothing: what was read of pictures is not said."""

    def truth(self, truth: Truth, stamp_ns: int) -> Facts | None:
        """All facts, some times a second; the limit in force when it changes."""
        facts = tuple(self._changed(truth, stamp_ns))
        if facts or self._said_ns is None or stamp_ns - self._said_ns >= AGAIN_NS:
            self._said_ns = stamp_ns
            facts = (*_place(truth, stamp_ns), *facts, *_ahead(truth, stamp_ns), *_stops(truth, stamp_ns))
        return Facts(facts=facts, backend=BACKEND) if facts else None

    def _changed(self, truth: Truth, stamp_ns: int) -> Iterator[Fact]:
        """The new limit is passed; where it is no lower one, what was in force ends before."""
        law = (truth.law_limit_mps, truth.jurisdiction)
        if law == self._law:
            return
        before, self._law = self._law, law
        for reading in (*(ENDS if _lifts(before, law) else ()), *_number(truth)):
            self._changes += 1
            yield _fact(reading, FIRST_ID + self._changes, truth, stamp_ns, passed=True)


def _lifts(before: Law | None, law: Law) -> bool:
    """Whether the former limit must end for this one to count; a lower one counts beside it."""
    if before is None or before[1] != law[1]:
        return before is not None
    return law[0] is None or (before[0] is not None and law[0] > before[0])


def _number(truth: Truth) -> tuple[str, ...]:
    """The limit in force as a sign's code; none where there is no limit, or no sign could show it."""
    if truth.law_limit_mps is None:
        return ()
    value = from_mps(truth.law_limit_mps, _unit(truth))
    return (f"limit:{round(value)}",) if abs(value - round(value)) < 0.1 else ()


def _unit(truth: Truth) -> Unit:
    row = JURISDICTIONS.get(truth.jurisdiction)
    return row.unit if row is not None else "km/h"


def _place(truth: Truth, stamp_ns: int) -> Iterator[Fact]:
    row = JURISDICTIONS.get(truth.jurisdiction)
    stated: tuple[tuple[FactKind, str], ...] = (("jurisdiction", truth.jurisdiction),)
    if row is not None:
        stated = (*stated, ("units", row.unit), ("traffic_side", row.side))
    for kind, reading in stated:
        yield Fact(kind=kind, reading=reading, confidence=1.0, frame_stamp_ns=stamp_ns, track_id=0)


def _ahead(truth: Truth, stamp_ns: int) -> Iterator[Fact]:
    """The signs that face us, their plates with them. Where a limit is passed, the law's change says so."""
    for sign in truth.signs:
        x_m, y_m = float(sign["x_m"]), float(sign["y_m"])
        if x_m <= 0.0 or abs(y_m) > ASIDE_M or float(sign.get("faces_ego", 1.0)) < 0.5:
            continue
        codes = str(sign["code"]).split("+")
        plates = tuple(code for code in codes if code.startswith("plate:"))
        for place, code in enumerate(each for each in codes if not each.startswith("plate:")):
            number = int(float(sign["id"])) * 8 + place
            yield _fact(code, number, truth, stamp_ns, distance_m=x_m, lateral_m=y_m, plates=plates)


def _stops(truth: Truth, stamp_ns: int) -> Iterator[Fact]:
    if truth.stop_kind in STOPS and truth.stop_distance_m is not None:
        distance_m = truth.stop_distance_m + HALF_EGO_M
        yield _fact(STOPS[truth.stop_kind], STOP_ID, truth, stamp_ns, distance_m=distance_m)
    if truth.light is not None and truth.light_distance_m is not None:
        distance_m = truth.light_distance_m + HALF_EGO_M
        yield _fact(f"light:{truth.light}", LIGHT_ID, truth, stamp_ns, distance_m=distance_m)


def _fact(
    reading: str, number: int, truth: Truth, stamp_ns: int, *, passed: bool = False,
    distance_m: float | None = None, lateral_m: float | None = None, plates: tuple[str, ...] = (),
) -> Fact:  # fmt: skip
    statement = statement_of(reading)
    wet = statement.scope == "permanent" and any(plate.startswith("plate:when_wet") for plate in plates)
    scope: Scope = "when_wet" if wet else "end" if "plate:end" in plates else statement.scope
    return Fact(
        kind=statement.kind,
        reading=public_code(reading),
        confidence=1.0,
        frame_stamp_ns=stamp_ns,
        track_id=number,
        value=statement.value,
        unit=_unit(truth) if statement.value is not None else None,
        scope=scope,
        distance_m=distance_m,
        lateral_m=lateral_m,
        plates=plates,
        passed=passed,
    )
