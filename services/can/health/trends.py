"""Quantities on their way to a warning: announced before the lamp, with the minutes left.

The slope is the median of all pairwise slopes (Theil 1950, Sen 1968), its interval by Kendall's variance at z = 3.3
(one in a thousand), so that noise, steps of the sensor and single errors announce nothing. A tyre is judged by its share
of nominal pressure at 20 degC (ideal gas at constant volume) against the middle of the other three: warmth and weather
move all four, a leak one. A trend once announced stays until it is not seen for `QUIET_S`, and comes back only after
that.
"""

import math
import statistics
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from domain.languages import LANGUAGES, spoken_language
from proto.vehicle import Trend
from services.can.health.ratios import TYRES

Values = Mapping[str, float | None]
NS = 1_000_000_000
Z = 3.3
QUIET_S = 300.0
LEAST_POINTS = 12
FAST_MIN = 5.0
"""A leak whose warning is nearer than this is told as a fast one."""
ATMOSPHERE_BAR, KELVIN, REFERENCE_C = 1.013, 273.15, 20.0
TYRE_WARNING_SHARE = 0.8
"""UN R141: the car warns at 20 % under the nominal pressure."""


class Slope(NamedTuple):
    """Per second: the middle and the ends of the interval."""

    middle: float
    low: float
    high: float


class Rule(NamedTuple):
    """One quantity: how often it is looked at, over how long, and when it is worth a word."""

    name: str
    field: str
    unit: str
    threshold: float
    period_s: float
    points: int
    within_min: float
    """Announced where the threshold is nearer than this."""
    least_change: float
    """And where the slope made at least this much of a change in the window: more than the sensor's steps."""
    from_value: float = math.inf
    """And only beyond this value, seen in the direction of the threshold; inf: from anywhere."""
    falling: bool = True


def _tyre_rules(wheel: str, tyre: str) -> tuple[Rule, ...]:
    return (
        Rule(f"slow_leak_{wheel}", tyre, "share of nominal", TYRE_WARNING_SHARE, 10.0, 90, 60.0, 0.03),
        Rule(f"slow_leak_{wheel}", tyre, "share of nominal", TYRE_WARNING_SHARE, 1.0, 40, 10.0, 0.03),
    )


def _brake_rule(wheel: str) -> Rule:
    field = f"brake_temperature_{wheel}_c"
    return Rule(f"brakes_heating_{wheel}", field, "degC", 350.0, 5.0, 36, 5.0, 60.0, 220.0, falling=False)


RULES: tuple[Rule, ...] = (
    *(rule for wheel, tyre in zip(("fl", "fr", "rl", "rr"), TYRES, strict=True) for rule in _tyre_rules(wheel, tyre)),
    # Linings fade from about 350 degC; a disc that climbs past 220 over three minutes drags, or the hill is long.
    *(_brake_rule(wheel) for wheel in ("fl", "fr", "rl", "rr")),
    # A charging generator holds 13.5 V and more; 12.0 V is half a battery.
    Rule("battery_sinking", "battery_voltage_v", "V", 12.0, 10.0, 60, 60.0, 0.3, 13.2),
    # A thermostat holds 85 to 105 degC.
    Rule("coolant_rising", "coolant_temperature_c", "degC", 115.0, 5.0, 36, 15.0, 5.0, 104.0, falling=False),
)


def theil_sen(points: Sequence[tuple[float, float]]) -> Slope | None:
    """The slope of (s, value) pairs with its interval; None below `LEAST_POINTS`."""
    count = len(points)
    if count < LEAST_POINTS:
        return None
    slopes = sorted((b[1] - a[1]) / (b[0] - a[0]) for i, a in enumerate(points) for b in points[i + 1 :] if b[0] > a[0])
    half = Z * math.sqrt(count * (count - 1) * (2 * count + 5) / 18.0) / 2.0
    mid = len(slopes) / 2.0
    low, high = max(0, int(mid - half)), min(len(slopes) - 1, int(mid + half))
    return Slope(statistics.median(slopes), slopes[low], slopes[high])


def compensated(values: Values, nominal_bar: Sequence[float]) -> dict[str, float | None]:
    """Share of nominal pressure of each tyre at 20 degC, divided by the middle of the others (where three are known)."""
    shares = {}
    for name, nominal in zip(TYRES, nominal_bar, strict=True):
        bar, warm_c = values.get(name), values.get(name.replace("pressure", "temperature").replace("_bar", "_c"))
        if bar is not None:
            warmth = 1.0 if warm_c is None else (KELVIN + REFERENCE_C) / (KELVIN + warm_c)
            shares[name] = ((bar + ATMOSPHERE_BAR) * warmth - ATMOSPHERE_BAR) / nominal
    if len(shares) < 3:
        return dict.fromkeys(TYRES)
    found: dict[str, float | None] = dict.fromkeys(TYRES)
    for name, share in shares.items():
        found[name] = share / statistics.median(other for each, other in shares.items() if each != name)
    return found


class _Track:
    """One quantity over time."""

    def __init__(self, rule: Rule) -> None:
        self.rule = rule
        self.trend: Trend | None = None
        self._points: deque[tuple[float, float]] = deque(maxlen=rule.points)
        self._pending: list[float] = []
        self._since_ns = 0
        self._seen_ns = 0

    def step(self, value: float | None, stamp_ns: int) -> None:
        """One sample later; a period's samples count as their mean."""
        if value is not None:
            self._pending.append(value)
        if stamp_ns < self._since_ns:
            self._points.clear()
            self._since_ns = stamp_ns
        if stamp_ns - self._since_ns < self.rule.period_s * NS:
            return
        self._since_ns = stamp_ns
        if self._pending:
            self._points.append((stamp_ns / NS, statistics.fmean(self._pending)))
            self._pending.clear()
            self._look(stamp_ns)

    def _look(self, stamp_ns: int) -> None:
        found = judged(self.rule, tuple(self._points))
        if found is not None:
            self.trend, self._seen_ns = found, stamp_ns
        elif self.trend is not None and stamp_ns - self._seen_ns > QUIET_S * NS:
            self.trend = None


def judged(rule: Rule, points: Sequence[tuple[float, float]]) -> Trend | None:
    """The trend in these points, if it is one and near its threshold."""
    sign = -1.0 if rule.falling else 1.0
    if len(points) < LEAST_POINTS or sign * (_end(points[-3:]) - _end(points[:3])) < 0.5 * rule.least_change:
        return None  # nothing to work out slopes for
    slope = theil_sen(points)
    if slope is None:
        return None
    slow, fast = sorted((sign * slope.low, sign * slope.high))
    change = slow * (points[-1][0] - points[0][0])
    now = _end(points[-3:])
    left = sign * (rule.threshold - now)
    near = math.isinf(rule.from_value) or sign * (now - rule.from_value) >= 0.0
    if slow <= 0.0 or change < rule.least_change or not near:
        return None
    minutes = [max(0.0, left) / each / 60.0 for each in (fast, sign * slope.middle, slow)]
    if minutes[1] > rule.within_min:
        return None
    return Trend(
        name=rule.name, value=now, threshold=rule.threshold, unit=rule.unit, rate_per_min=slope.middle * 60.0,
        minutes_left=minutes[1], minutes_low=minutes[0], minutes_high=minutes[2],
    )  # fmt: skip


def _end(points: Sequence[tuple[float, float]]) -> float:
    return statistics.median(value for _, value in points)


class Trends:
    """All quantities of one car. One thread steps; others read `found`."""

    def __init__(self, tyre_nominal_bar: tuple[float, ...]) -> None:
        self._nominal = tyre_nominal_bar
        self._tracks = tuple(_Track(rule) for rule in RULES)
        self.found: tuple[Trend, ...] = ()

    def step(self, values: Values, stamp_ns: int) -> None:
        """One sample later; a leak seen over both windows is told by the nearer end."""
        seen = {**values, **compensated(values, self._nominal)}
        for track in self._tracks:
            track.step(seen.get(track.rule.field), stamp_ns)
        found = sorted((each.trend for each in self._tracks if each.trend is not None), key=lambda t: -t.minutes_left)
        self.found = tuple({trend.name: trend for trend in found}.values())


# The columns of both tables are the languages, in their order.
_WHEELS = {
    "fl": (
        "front left",
        "vorn links",
        "avant gauche",
        "linksvoor",
        "lewy przód",
        "anteriore sinistra",
        "delantera izquierda",
    ),
    "fr": (
        "front right",
        "vorn rechts",
        "avant droit",
        "rechtsvoor",
        "prawy przód",
        "anteriore destra",
        "delantera derecha",
    ),
    "rl": (
        "rear left",
        "hinten links",
        "arrière gauche",
        "linksachter",
        "lewy tył",
        "posteriore sinistra",
        "trasera izquierda",
    ),
    "rr": (
        "rear right",
        "hinten rechts",
        "arrière droit",
        "rechtsachter",
        "prawy tył",
        "posteriore destra",
        "trasera derecha",
    ),
}
_TEXTS: Mapping[str, tuple[str, ...]] = {
    "slow_leak": (
        "The {wheel} tyre is losing air; its warning comes in about {minutes} min. Check it at the next stop.",
        "Der Reifen {wheel} verliert Luft; die Warnung kommt in etwa {minutes} min. Beim nächsten Halt prüfen.",
        "Le pneu {wheel} perd de l'air ; son alerte viendra dans environ {minutes} min. À contrôler au prochain arrêt.",
        "De band {wheel} verliest lucht; de waarschuwing komt over ongeveer {minutes} min. Controleer hem bij de volgende stop.",
        "Opona ({wheel}) traci powietrze; ostrzeżenie za około {minutes} min. Sprawdź ją na najbliższym postoju.",
        "La gomma {wheel} perde aria; l'avviso arriva tra circa {minutes} min. Controllala alla prossima sosta.",
        "La rueda {wheel} pierde aire; el aviso llega en unos {minutes} min. Compruébela en la próxima parada.",
    ),
    "leak_fast": (
        "The {wheel} tyre is losing air fast; its warning comes in about {minutes} min. Slow down and stop soon.",
        "Der Reifen {wheel} verliert schnell Luft; die Warnung kommt in etwa {minutes} min. Langsamer fahren, bald "
        "anhalten.",
        "Le pneu {wheel} perd vite de l'air ; son alerte viendra dans environ {minutes} min. Ralentissez, arrêtez-vous bientôt.",
        "De band {wheel} verliest snel lucht; de waarschuwing komt over ongeveer {minutes} min. Rijd langzamer en stop snel.",
        "Opona ({wheel}) szybko traci powietrze; ostrzeżenie za około {minutes} min. Zwolnij i wkrótce się zatrzymaj.",
        "La gomma {wheel} perde aria in fretta; l'avviso arriva tra circa {minutes} min. Rallenta e fermati presto.",
        "La rueda {wheel} pierde aire deprisa; el aviso llega en unos {minutes} min. Reduzca y pare pronto.",
    ),
    "brakes_heating": (
        "The {wheel} brake is getting hot; it begins to fade in about {minutes} min. Use a lower gear and brake less.",
        "Die Bremse {wheel} wird heiß; in etwa {minutes} min lässt sie nach. Herunterschalten und weniger bremsen.",
        "Le frein {wheel} chauffe ; il faiblira dans environ {minutes} min. Rétrogradez et freinez moins.",
        "De rem {wheel} wordt heet; over ongeveer {minutes} min wordt hij zwakker. Schakel terug en rem minder.",
        "Hamulec ({wheel}) się nagrzewa; za około {minutes} min osłabnie. Zredukuj bieg i mniej hamuj.",
        "Il freno della ruota {wheel} si scalda; tra circa {minutes} min perde forza. Scala marcia e frena meno.",
        "El freno de la rueda {wheel} se calienta; en unos {minutes} min pierde fuerza. Reduzca de marcha y frene menos.",
    ),
    "battery_sinking": (
        "The battery is not being charged; it is low in about {minutes} min. Drive to a workshop, switch off what is "
        "not needed.",
        "Die Batterie wird nicht geladen; in etwa {minutes} min ist sie schwach. Zur Werkstatt fahren, Verbraucher "
        "ausschalten.",
        "La batterie ne se charge pas ; elle sera faible dans environ {minutes} min. Allez au garage, coupez l'inutile.",
        "De accu wordt niet geladen; over ongeveer {minutes} min is hij zwak. Rijd naar een garage, zet uit wat niet nodig is.",
        "Akumulator się nie ładuje; za około {minutes} min będzie słaby. Jedź do warsztatu, wyłącz to, co zbędne.",
        "La batteria non si carica; tra circa {minutes} min è scarica. Vai in officina, spegni quello che non serve.",
        "La batería no se carga; en unos {minutes} min estará baja. Vaya al taller, apague lo que no haga falta.",
    ),
    "coolant_rising": (
        "The engine is getting too hot; its warning comes in about {minutes} min. Drive gently, heater on full.",
        "Der Motor wird zu heiß; die Warnung kommt in etwa {minutes} min. Sanft fahren, Heizung voll aufdrehen.",
        "Le moteur chauffe trop ; son alerte viendra dans environ {minutes} min. Roulez doucement, chauffage à fond.",
        "De motor wordt te heet; de waarschuwing komt over ongeveer {minutes} min. Rijd rustig, verwarming op vol.",
        "Silnik się przegrzewa; ostrzeżenie za około {minutes} min. Jedź łagodnie, ogrzewanie na maksimum.",
        "Il motore si scalda troppo; l'avviso arriva tra circa {minutes} min. Guida piano, riscaldamento al massimo.",
        "El motor se calienta demasiado; el aviso llega en unos {minutes} min. Conduzca suave, calefacción al máximo.",
    ),
}


def in_words(trend: Trend, language: str) -> str:
    """The trend as a driver is told it."""
    column = LANGUAGES.index(spoken_language(language))
    kind, _, wheel = trend.name.rpartition("_")
    if kind == "slow_leak" and trend.minutes_left < FAST_MIN:
        kind = "leak_fast"
    text = _TEXTS.get(kind) or _TEXTS[trend.name]
    place = _WHEELS[wheel][column] if wheel in _WHEELS else ""
    return text[column].format(wheel=place, minutes=max(1, math.ceil(trend.minutes_left)))
