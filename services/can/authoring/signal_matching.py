"""Which signals of a description may feed a curated field: scored by name, comment, unit and width, never certain."""

import re
from collections.abc import Iterable
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import msgspec

from services.can.errors import ProfileError
from services.can.profiles.curated import FIELDS
from services.can.profiles.units import canonical, linear

CLEAR_SCORE, CLEAR_LEAD = 6.0, 1.0
"""A best candidate below this score, or less far ahead of the next, is not chosen for the engineer."""
IN_NAME, IN_COMMENT, RIGHT_UNIT, ONE_BIT, NAMED = 2.5, 1.5, 3.0, 2.0, 1.0
EXTRA_WORD = 0.3
"""What each word of the name that says something else costs."""


class Hint(msgspec.Struct, frozen=True):
    """Words of which each group must appear (`*`: as a beginning), words that rule a signal out, and what is plausible."""

    groups: tuple[str, ...]
    never: str = ""
    minimum: float = 0.0
    maximum: float = 1.0
    max_age_s: float = 1.0
    max_step_per_s: float | None = None


NEVER = (
    "cmd command req request rq desired target soll setpoint limit max min mx mn offset delta error err crc checksum cs "
    "counter cnt qf qbit quality valid inv unit units display disp trailer anhaenger radar object obj acc gps diag test"
)
_SIDES = {
    "fl": "fl frl lf vl frontleft leftfront lfront frontl",
    "fr": "fr frr rf vr frontright rightfront rfront frontr",
    "rl": "rl rel lr hl rearleft leftrear lrear rearl",
    "rr": "rr rer hr rearright rightrear rrear rearr",
}
_FAST = 0.2


def _wheels(form: str, *groups: str, minimum: float = 0.0, maximum: float, max_age_s: float) -> dict[str, Hint]:
    return {
        form.format(side): Hint((*groups, words), "", minimum, maximum, max_age_s) for side, words in _SIDES.items()
    }


HINTS: dict[str, Hint] = {
    "speed_mps": Hint(("speed v geschw* vehiclespeed vehspd", "vehicle veh car esp vehiclespeed speed signal"),
                      "wheel whl engine eng motor fan wiper wind yaw rate steering cruise set rel lead digital ui",
                      0.0, 83.4, _FAST, 30.0),
    "acceleration_mps2": Hint(("accel* laengsbeschl* longaccel a", "long* x laengs*"),
                              "lat* pedal gas", -15.0, 12.0, _FAST),
    "lateral_acceleration_mps2": Hint(("accel* querbeschl* lataccel quer* a", "lat* y quer*"),
                                      "long* pedal", -15.0, 15.0,
                                      _FAST),
    "yaw_rate_radps": Hint(("yaw* gier*", "rate gierrate yawrate w yaw"), "accel*", -2.0, 2.0, _FAST),
    "steering_angle_rad": Hint(("steer* lenk* sas lwi ste", "angle winkel lenkradwinkel lenkradw an"),
                               "rate speed torque geschw* velocity",
                               -0.9, 0.9, _FAST),
    "brake_pressure_bar": Hint(("brake brk brems* brk master", "pressure press prs bremsdruck druck"),
                               "booster air parking", -5.0, 250.0, _FAST),
    "brake_pedal": Hint(("brake brk brems*", "pedal pos* position"), "pressed switch force", 0.0, 1.0, _FAST),
    "brake_pressed": Hint(("brake brk brems* bremst", "pressed pedal driver fahrer applied switch"),
                          "pressure force", max_age_s=_FAST),
    "accelerator_pedal": Hint(("accelerator accel* gas throttle fahrpedal* aped", "pedal pos* position fahrpedal*"),
                              "brake rate long lat", 0.0, 1.0, _FAST),
    "parking_brake": Hint(("parking park handbrake hand handbremse epb prk", "brake brk handbrake handbremse status state"),
                          "assist lamp light aid"),
    "gear": Hint(("gear gang fahrstufe prnd",), "ratio oil temp*", -1.0, 10.0),
    "engine_running": Hint(("engine eng motor", "running run laeuft"), "light lights daytime"),
    "abs_active": Hint(("abs", "active actv engaged event bremsung act"), "fault lamp fehler", max_age_s=_FAST),
    "abs_fault": Hint(("abs", "fault falt failure fehler defect def err error"), "active"),
    "esc_active": Hint(("esc esp vsc stab* dsc", "active actv engaged eingriff intervention act"),
                       "fault lamp", max_age_s=_FAST),
    "esc_fault": Hint(("esc esp vsc stab* dsc", "fault failure fehler defect def"), "active"),
    "esc_off": Hint(("esc esp vsc stab* dsc", "off passiv disabled switched"), "fault lamp"),
    "traction_active": Hint(("traction tcs asr tc trac", "active actv engaged act anf"),
                            "fault lamp", max_age_s=_FAST),
    "brake_fluid_low": Hint(("brake brk brems*", "fluid fluessigkeit"), ""),
    "brake_lining_worn": Hint(("brake brk brems*", "lining pad belag* wear worn verschleiss*"), "temp*"),
    "brake_booster_fault": Hint(("booster bkv ibst*", "fault failure fehler defect def"), "lamp"),
    "steering_assist_fault": Hint(("steer* eps lenk*", "fault failure fehler defect def"), "angle winkel lamp"),
    "wiper_stage": Hint(("wiper* wipe wipr wischer*",), "rear heck heat* wash*", 0.0, 3.0, 2.0),
    "rain_sensor": Hint(("rain* regen*", "sensor intensity amount level detect*"), "light licht", 0.0, 1.0, 2.0),
    "outside_temperature_c": Hint(("temp* tempe* te", "out* aussen ambient amb ext* outside airamb"),
                                  "engine oil coolant cabin inside in",
                                  -40.0, 60.0, 5.0, 2.0),
    "outside_light_lux": Hint(("light licht* helligkeit ambient", "sensor lux brightness"), "rain regen", 0.0, 130_000.0, 2.0),
    "headlamps": Hint(("headlamp* headlight* head lowbeam abblendlicht",
                       "lamp* light* low headlamp* headlamps status state mode on"),
                      "wash* level out fault", 0.0, 3.0, 2.0),
    "fog_lamp_rear": Hint(("fog nebel*", "rear schluss nebelschluss"), "front"),
    "indicator_left": Hint(("turn* indicator* blink* blinker", "left links li l"), "right fault def"),
    "indicator_right": Hint(("turn* indicator* blink* blinker", "right rechts re r"), "left fault def"),
    "hazard_lights": Hint(("hazard* warnblink*",), "fault"),
    "coolant_temperature_c": Hint(("coolant clnt water ect", "temp* te"),
                                  "out* ambient battery motor", -40.0, 180.0, 3.0),
    "oil_pressure_bar": Hint(("oil oel*", "pressure press"), "brake trans*", 0.0, 12.0, 3.0),
    "fuel_share": Hint(("fuel tank", "level share percent"), "rate", 0.0, 1.0, 5.0),
    "battery_voltage_v": Hint(("battery batt batterie ", "volt* voltage u"), "traction hv cell pack", 0.0, 24.0, 3.0),
    "lamp_engine": Hint(("mil checkengine",), "rq"),
    "lamp_engine_flashing": Hint(("mil engine checkengine", "flash* blink*"), "rq"),
    "lamp_abs": Hint(("abs", "lamp* lampe warning mil tell*"), ""),
    "lamp_stability": Hint(("esc esp vsc stab*", "lamp* lampe warning tell*"), "flash"),
    "lamp_brake": Hint(("brake brk bkl", "lamp lampe warning tell*"), "lights light stop"),
    "lamp_tyre": Hint(("tire tyre tpms reifen", "lamp lampe warning"), ""),
    "lamp_coolant": Hint(("coolant water kuehl*", "lamp lampe warning"), ""),
    "lamp_oil": Hint(("oil oel*", "lamp lampe warning oeldruckwarnung"), ""),
    "lamp_battery": Hint(("battery batt charge", "lamp lampe warning"), ""),
    "lamp_fuel": Hint(("fuel tankwarnung", "lamp lampe warning low tankwarnung"), "filter"),
    "lamp_steering": Hint(("steer* eps lenkung", "lamp lampe warning"), ""),
    **_wheels("wheel_{}_mps", "wheel* whl rad* wss", "speed spd w v radgeschw* geschw* wheelspeed", maximum=88.0, max_age_s=_FAST),
    **_wheels("tyre_pressure_{}_bar", "tire tyre tpms reifen*", "pressure press druck", maximum=4.5, max_age_s=120.0),
    **_wheels("tyre_temperature_{}_c", "tire tyre tpms reifen*", "temp*", minimum=-40.0, maximum=150.0, max_age_s=120.0),
    **_wheels("brake_temperature_{}_c", "brake brk disc", "temp*", minimum=-40.0, maximum=900.0, max_age_s=5.0),
}  # fmt: skip
"""What to look for, in the words that descriptions use (English and German)."""


class Candidate(NamedTuple):
    """A signal that may feed a field, and how well it looks."""

    message: Any
    signal: Any
    score: float

    @property
    def place(self) -> str:
        """MESSAGE.SIGNAL."""
        return f"{self.message.name}.{self.signal.name}"


@cache
def words(text: str) -> list[str]:
    """The words of a name, in small letters: `ESP_wheelSpeedFrL` is esp, wheel, speed, fr, l."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", text)
    return [part.lower() for part in parts]


def candidates(field: str, messages: Iterable[Any]) -> list[Candidate]:
    """Every signal that may be this field, best first."""
    found = [
        Candidate(message, signal, round(score, 1))
        for message in messages
        for signal in message.signals
        if (score := _score(field, message, signal)) > 0
    ]
    return sorted(found, key=lambda each: (-each.score, each.place))


def clear(found: list[Candidate]) -> Candidate | None:
    """The best one, where it is good and well ahead."""
    if not found or found[0].score < CLEAR_SCORE:
        return None
    return found[0] if len(found) == 1 or found[0].score - found[1].score >= CLEAR_LEAD else None


def _score(field: str, message: Any, signal: Any) -> float:
    hint, parts = HINTS.get(field), words(signal.name)
    if hint is None or _any(parts, f"{NEVER} {hint.never}"):
        return 0.0
    name, around = _joined(parts), _joined(words(f"{message.name} {signal.comment or ''}"))
    points = sum(
        IN_NAME if _any(name, group) else IN_COMMENT if _any(around, group) else -99.0 for group in hint.groups
    )
    if points < IN_NAME:  # a word is found nowhere, or none in the signal's own name
        return 0.0
    spoken = sum(1 for part in parts if _any([part], " ".join(hint.groups)))
    fit = _fit(field, signal)
    return 0.0 if fit is None else points * 2 / len(hint.groups) + fit - EXTRA_WORD * (len(parts) - spoken)


def _fit(field: str, signal: Any) -> float | None:
    """How well unit and width fit; None: not at all."""
    wanted, unit = FIELDS[field].unit, signal.unit or ""
    if not wanted:
        if canonical(unit) is not None:
            return None
        return ONE_BIT if signal.length == 1 else NAMED if signal.choices else 0.0
    if signal.length < 4 or (signal.choices and len(signal.choices) > 8):
        return None
    try:
        linear(unit, wanted)
    except ProfileError:
        return None if canonical(unit) is not None else 0.0
    return RIGHT_UNIT


def _joined(parts: list[str]) -> list[str]:
    """The words, and each two and three that follow each other as one."""
    pairs = [a + b for a, b in pairwise(parts)]
    return [*parts, *pairs, *(a + b + c for a, b, c in zip(parts, parts[1:], parts[2:], strict=False))]


def _any(parts: list[str], alternatives: str) -> bool:
    return any(
        part.startswith(each[:-1]) if each.endswith("*") else part == each
        for each in alternatives.split()
        for part in parts
    )
