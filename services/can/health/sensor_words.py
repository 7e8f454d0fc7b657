"""Sensors as a driver is told of them, by the quantity that they measure."""

from collections.abc import Mapping

from domain.languages import LANGUAGES, spoken_language

QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "wheel_": (
        "wheel speed", "Raddrehzahl", "vitesse de roue", "wielsnelheid",
        "prędkość koła", "velocità ruota", "velocidad de rueda",
    ),
    "speed_": (
        "speed", "Geschwindigkeit", "vitesse", "snelheid",
        "prędkość", "velocità", "velocidad",
    ),
    "acceleration_": (
        "acceleration", "Beschleunigung", "accélération", "versnelling",
        "przyspieszenie", "accelerazione", "aceleración",
    ),
    "yaw_rate_": (
        "rate of turn", "Drehrate", "vitesse de lacet", "draaisnelheid",
        "prędkość skrętu", "velocità d'imbardata", "velocidad de giro",
    ),
    "brake_pressure_": (
        "brake pressure", "Bremsdruck", "pression de frein", "remdruk",
        "ciśnienie hamulców", "pressione freni", "presión de frenos",
    ),
    "tyre_pressure_": (
        "tyre pressure", "Reifendruck", "pression des pneus", "bandenspanning",
        "ciśnienie w oponach", "pressione gomme", "presión de neumáticos",
    ),
    "outside_temperature_": (
        "outside temperature", "Außentemperatur", "température extérieure", "buitentemperatuur",
        "temperatura zewnętrzna", "temperatura esterna", "temperatura exterior",
    ),
}  # fmt: skip
"""By the beginning of the field's name, in the order of `LANGUAGES`."""


def in_words(field: str, language: str) -> str:
    """The sensor of a field, in a language; of an unknown field its name without units and marks."""
    column = LANGUAGES.index(spoken_language(language))
    words = next((words for prefix, words in QUANTITIES.items() if field.startswith(prefix)), None)
    return words[column] if words is not None else field.rpartition("_")[0].replace("_", " ") or field
