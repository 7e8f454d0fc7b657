"""From fields and trouble codes to degradation h, the braking still to be had, and what to do about it.

h = 1 - exp(-sum_k w_k psi_k): the paper's weighted sum under a squashing that maps no fault to 0 exactly (a logistic
one would give 0.5)
and grows with every psi. A fault that was believed is held until its own signal says otherwise: silence never heals a
car.
"""

import math
from collections.abc import Mapping

import msgspec

from domain.languages import spoken_language
from proto.vehicle import Degradation, Indicator, SensorFault, Trend, VehicleHealth
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.health import sensor_words
from services.can.health.indicators import (
    BUS_SILENT_WEIGHT,
    CODE_PSI,
    CODES_WEIGHT,
    LAMPS,
    SENSORS_WEIGHT,
    Psi,
    Seen,
    Values,
)
from services.can.health.trends import in_words
from services.can.health.trusted import Readings

_UNKNOWN_BRAKES_SPEED_FACTOR = 0.8
_DRIVE = ("yes", "with_care", "stop_soon", "stop_now")
_SEVERITY_DRIVE: Mapping[str, str] = {
    "note": "yes", "service": "yes", "careful": "with_care", "stop_soon": "stop_soon", "stop_now": "stop_now",
}  # fmt: skip


class Held(msgspec.Struct, frozen=True, kw_only=True):
    """What was last believed: psi by indicator, lamps that were on, codes. Empty at the start of a drive."""

    psi: dict[str, float] = {}
    lamps: frozenset[str] = frozenset()
    ever_seen: bool = False


class Assessment(msgspec.Struct, frozen=True, kw_only=True):
    """The degradation, with what the next assessment must remember."""

    degradation: Degradation
    held: Held
    confidence: float


def field_values(board: Readings, names: frozenset[str], now_ns: int) -> dict[str, float | None]:
    """The fields that health reads, of those that this car has; None where one cannot be used now."""
    return {name: board.read(name, now_ns).value for name in names if name in board.fields}


def forget(table: tuple[Psi, ...], held: Held, convicted: frozenset[str]) -> Held:
    """Without what these sensors made us believe: their word is void, not silent."""
    void = {psi.name for psi in table if convicted & set(psi.fields)}
    return msgspec.structs.replace(held, psi={name: psi for name, psi in held.psi.items() if name not in void})


def assess(
    table: tuple[Psi, ...],
    values: Values,
    codes: tuple[str, ...],
    book: DtcBook,
    held: Held,
    sensor_faults: tuple[SensorFault, ...] = (),
    trends: tuple[Trend, ...] = (),
) -> Assessment:
    """The health at one instant.

    `values` has a key for every field this car has. An indicator whose fields it lacks does not exist here. An indicator
    is unknown where a field that it needs is `None`: it keeps at least the psi it last had, and costs at least its
    share of braking. Until a first value is read, h and envelope are `None`.
    """
    rows = [psi for psi in table if psi.on(values)]
    now = {psi.name: psi.reads(values) for psi in rows}
    unknown = tuple(name for name, shown in now.items() if not shown.complete)
    seen = held.ever_seen or len(unknown) < len(rows) or bool(codes)
    believed = {name: _believe(shown, held.psi.get(name, 0.0)) for name, shown in now.items()}
    lamps = _lamps(values, held.lamps)
    told = [psi.name for psi in rows if psi.from_bus(values)]
    silent = seen and bool(told) and set(told) <= set(unknown)
    indicators = [_indicator(psi, believed[psi.name], now[psi.name]) for psi in rows]
    indicators += _beyond_fields(codes, book, sensor_faults, silent=silent)
    read = {name for name, shown in now.items() if shown.complete or shown.value > 0.0} | held.psi.keys()
    degradation = Degradation(
        h=squash(indicators) if seen else None,
        indicators=tuple(each for each in indicators if each.value > 0.0),
        brake_envelope=_envelope(rows, believed, unknown, read),
        dtcs=codes,
        warning_lamps=tuple(sorted(LAMPS[name] for name in lamps)),
        unknown=unknown,
        sensor_faults=sensor_faults,
        trends=trends,
    )
    kept = Held(psi={name: believed.get(name, held.psi.get(name, 0.0)) for name in read}, lamps=lamps, ever_seen=seen)
    return Assessment(degradation=degradation, held=kept, confidence=1.0 - len(unknown) / len(rows) if rows else 0.0)


def squash(indicators: list[Indicator]) -> float:
    """h in [0, 1): 0 exactly where no indicator is raised."""
    return -math.expm1(-sum(each.weight * each.value for each in indicators))


def _believe(shown: Seen, before: float) -> float:
    """All of it seen: that. Part of it silent: no less than was believed before."""
    return shown.value if shown.complete else max(shown.value, before)


def _lamps(values: Values, before: frozenset[str]) -> frozenset[str]:
    def on(name: str) -> bool:
        value = values.get(name)
        return name in before if value is None else value > 0.5

    return frozenset(name for name in LAMPS if on(name))


def _indicator(psi: Psi, value: float, shown: Seen) -> Indicator:
    detail = shown.detail if shown.complete else "not all of it reported now; held from before"
    return Indicator(name=psi.name, value=value, weight=psi.weight, source="can", detail=detail)


def _beyond_fields(
    codes: tuple[str, ...], book: DtcBook, faults: tuple[SensorFault, ...], *, silent: bool
) -> list[Indicator]:
    """What no single field tells: stored codes, contradicted sensors, a dead bus."""
    healthy = math.prod(1.0 - CODE_PSI[book.severity(code)] for code in codes)
    doubted = 1.0 - 0.5 ** len(faults)
    named = " ".join(f"{fault.kind} {fault.field}" for fault in faults)
    return [
        Indicator(name="trouble_codes", value=1.0 - healthy, weight=CODES_WEIGHT, source="obd", detail=" ".join(codes)),
        Indicator(name="sensors_faulty", value=doubted, weight=SENSORS_WEIGHT, source="crosscheck", detail=named),
        Indicator(name="bus_silent", value=float(silent), weight=BUS_SILENT_WEIGHT, source="can"),
    ]


def _envelope(rows: list[Psi], believed: Mapping[str, float], unknown: tuple[str, ...], read: set[str]) -> float | None:
    """Share of normal braking left. None where no signal of the brakes was ever read."""
    brakes = [psi for psi in rows if psi.loss > 0.0]
    if not any(psi.name in read for psi in brakes):
        return None
    return math.prod(1.0 - _loss(psi, believed[psi.name], unknown=psi.name in unknown) for psi in brakes)


def _loss(psi: Psi, value: float, *, unknown: bool) -> float:
    return max(psi.loss * value, psi.loss_unknown if unknown else 0.0)


def advise(table: tuple[Psi, ...], assessment: Assessment, book: DtcBook, language: str) -> VehicleHealth:
    """The degradation in words, and what it does to speed and distance."""
    degradation, language = assessment.degradation, spoken_language(language)
    raised = {each.name: each.value for each in degradation.indicators}
    texts = tuple(book.explain(code, language) for code in degradation.dtcs)
    steps = [psi.step for psi in table if raised.get(psi.name, 0.0) > 0.0]
    speed, headway = factors(degradation)
    return VehicleHealth(
        h=degradation.h,
        brake_envelope=degradation.brake_envelope,
        indicators=degradation.indicators,
        dtcs=texts,
        warning_lamps=degradation.warning_lamps,
        safe_to_drive=safe_to_drive(table, degradation, book),
        advice=_advice(steps, [text.next_step for text in texts], degradation, book, language),
        speed_factor=speed,
        headway_factor=headway,
        confidence=assessment.confidence,
        sensor_faults=degradation.sensor_faults,
        trends=degradation.trends,
    )


def factors(degradation: Degradation) -> tuple[float, float]:
    """(speed factor in (0, 1], headway factor >= 1). Braking distance goes with v^2 / a: speed falls with the root."""
    envelope = degradation.brake_envelope
    braking = math.sqrt(max(envelope, 0.1)) if envelope is not None else _UNKNOWN_BRAKES_SPEED_FACTOR
    h = degradation.h if degradation.h is not None else 0.0
    speed = min(braking, 1.0 - 0.35 * h)
    return speed, max(1.0 / braking**2, 1.0 + h)


def safe_to_drive(table: tuple[Psi, ...], degradation: Degradation, book: DtcBook) -> str:
    """`yes`, `with_care`, `stop_soon`, `stop_now`; `unknown` where nothing was read."""
    if degradation.h is None:
        return "unknown"
    raised = {each.name: each.value for each in degradation.indicators}
    words = [_SEVERITY_DRIVE[book.severity(code)] for code in degradation.dtcs]
    for psi in table:
        value = raised.get(psi.name, 0.0)
        if value > 0.0:
            words.append(psi.gravity if value >= 0.99 else "with_care")
    if raised.get("bus_silent") or degradation.sensor_faults or degradation.trends:
        words.append("with_care")
    return max(words, key=_DRIVE.index, default="yes" if not degradation.unknown else "with_care")


_FINE = {
    "en": "No fault is reported.",
    "de": "Kein Fehler gemeldet.",
    "fr": "Aucun défaut signalé.",
    "nl": "Er is geen storing gemeld.",
    "pl": "Nie zgłoszono usterki.",
    "it": "Nessun guasto segnalato.",
    "es": "No se avisa de ninguna avería.",
}
_SENSORS = {
    "en": "Not believed, because other sensors contradict: {}. Have it checked.",
    "de": "Nicht vertrauenswürdig, weil andere Sensoren widersprechen: {}. Prüfen lassen.",
    "fr": "Peu fiable, car d'autres capteurs disent le contraire : {}. À faire contrôler.",
    "nl": "Niet betrouwbaar, want andere sensoren spreken dit tegen: {}. Laat het nakijken.",
    "pl": "Niewiarygodne, bo przeczą temu inne czujniki: {}. Daj to sprawdzić.",
    "it": "Non affidabile, perché altri sensori lo contraddicono: {}. Fai controllare.",
    "es": "No es fiable, porque otros sensores lo contradicen: {}. Hágalo revisar.",
}
_PARTLY = {
    "en": "Part of the car's health cannot be read.",
    "de": "Ein Teil des Fahrzeugzustands ist nicht lesbar.",
    "fr": "Une partie de l'état du véhicule n'est pas lisible.",
    "nl": "Een deel van de toestand van de auto is niet te lezen.",
    "pl": "Części stanu samochodu nie można odczytać.",
    "it": "Una parte dello stato dell'auto non si può leggere.",
    "es": "Una parte del estado del coche no se puede leer.",
}


def _advice(steps: list[str], from_codes: list[str], degradation: Degradation, book: DtcBook, language: str) -> str:
    language = language if language in _FINE else "en"
    said = [book.step(step, language) for step in steps] + from_codes
    said += [in_words(trend, language) for trend in degradation.trends]
    texts = list(dict.fromkeys(said))
    if degradation.sensor_faults:
        named = dict.fromkeys(sensor_words.in_words(fault.field, language) for fault in degradation.sensor_faults)
        texts.append(_SENSORS[language].format(", ".join(named)))
    if degradation.unknown:
        texts.append(_PARTLY[language])
    return " ".join(texts) if texts else _FINE[language]
