"""How much braking friction water, cold and snow leave: bounds of the peak coefficient mu that a car with an anti-lock
system can use.

Sources of the relations; what is called ours is provisional and held by `studies.weather` alone.

* dry, snow and ice: Wallman and Åström, Friction measurement methods and the correlation between road friction and
  traffic safety, VTI meddelande 911A (2001). Dry bare 0.8 to 1.0, wet bare 0.7 to 0.8, packed snow 0.20 to 0.30, loose
  snow and slush 0.20 to 0.50, black ice 0.15 to 0.30, wet black ice 0.05 to 0.10. Our low ends lie below: worn roads.
* fall with the film: mu_f + (mu_0 - mu_f) exp(-b h), most of it below 0.23 mm: Kulakowski and Harwood, Effect of
  water-film thickness on tire-pavement friction, ASTM STP 1031 (1990). b and mu_f are ours.
* fall with speed: exp((60 - S) / Sp), Sp = 14.2 + 89.7 MPD, S the slip speed in km/h: International Friction Index,
  ASTM E1960. An anti-lock system slips by about 15 % (ours), so S changes by that share of the speed.
* depth of the film in rain: Gallaway and others, Pavement and geometric design criteria for minimizing hydroplaning,
  FHWA-RD-79-31 (1979), which gives the floating speed in films above 2.4 mm too.
* floating speed in thinner films: Huebner, Reed and Henry, Criteria for predicting hydroplaning potential, J. Transp.
  Eng. 112 (1986); it goes with the root of the tyre's pressure (Horne and Dreher, NASA TN D-2056, 1963).
* below it, lift and the lost contact grow with the square of speed (Horne and Joyner, SAE 650145, 1965) where the
  tread cannot drain the film.
"""

import math

from domain.units import MM_PER_INCH, MPS_PER
from services.weather.observations.observation import Interval, between

DRY = Interval(0.72, 0.98)
ICE = Interval(0.05, 0.30)
"""From wet to cold black ice: which of them it is, no temperature sensor tells."""
FROST = Interval(0.08, 0.65)
"""Hoar frost or a thin glaze on a road without standing water, from a closed cover to a thin one (ours)."""
UNKNOWN_LOW = 0.30
"""Temperature unknown on a road that may be wet: ice is assumed where cold is known, not where nothing is."""
UNKNOWN_DRY_LOW = 0.60
UNKNOWN_FILM_MM = 0.4
"""Water assumed where it is not known: steady moderate rain."""
SNOW_LOW = ((-15.0, 0.20), (-5.0, 0.17), (0.0, 0.12))
SNOW_HIGH = 0.45
"""Packed snow is the more slippery the nearer it is to melting; its temperature in degC."""

WET_LOW, WET_HIGH = 0.43, 0.74
"""mu at 60 km/h when the film lubricates fully: a worn and a good road."""
FALL_PER_MM, FALL_HIGH_PER_MM = 10.0, 6.0
MPD_MM, SLIP_SHARE = 0.5, 0.15
DRAINED_MM = 2.0
"""Film that a tread at the legal 1.6 mm on a smooth road no longer drains (ours)."""
LEGAL_TREAD_MM = 1.6
MIN_CONTACT = 0.15
"""Even a floating tyre touches ridges and its neighbour axle."""

TEXTURE_MM, PATH_M, SLOPE_PERCENT = 0.8, 3.65, 2.5
"""Macrotexture of a used road; one lane drained at a usual crossfall."""
RUT_MM = 0.35
"""Allowance for ruts, in which water stands deeper than the formula says."""
HUEBNER_MM = 2.4
_NOMINAL_PSI = 33.0


def rain_film_mm(rain_mm_h: float) -> float:
    """Water above the asperities in steady rain (mm), ruts included: Gallaway's WD = 0.103 T^0.11 L^0.43 I^0.59 /
    S^0.42 - T.
    """
    if rain_mm_h <= 0.0:
        return 0.0
    depth: float = 0.103 * TEXTURE_MM**0.11 * PATH_M**0.43 * rain_mm_h**0.59 / SLOPE_PERCENT**0.42 - TEXTURE_MM
    return max(0.0, depth) + RUT_MM * min(1.0, rain_mm_h / 5.0)


def floating_speed_mps(film_mm: float, tyre_low: float = 0.0, tread_mm: float = LEGAL_TREAD_MM) -> float:
    """Speed at which a tyre floats: 26.04 WD^-0.259 (mph, inches) up to 2.4 mm; above, no faster than Gallaway's
    speed.

    `tyre_low` in [0, 1]: how soft the tyres are; 1 is half the nominal pressure. A deeper tread than the legal one
    raises the speed by Gallaway's (TD + 1)^0.06, TD in 32nds of an inch.
    """
    film_in = max(film_mm, 0.01) / MM_PER_INCH
    thin: float = 26.04 * min(film_in, HUEBNER_MM / MM_PER_INCH) ** -0.259
    mph = thin if film_mm <= HUEBNER_MM else min(thin, _gallaway_mph(film_in))
    tread = ((max(tread_mm, 0.0) / 0.794 + 1.0) / (LEGAL_TREAD_MM / 0.794 + 1.0)) ** 0.06
    return float(mph * MPS_PER["mph"] * tread * (1.0 - 0.5 * tyre_low) ** 0.5)


def _gallaway_mph(film_in: float) -> float:
    """SD^0.04 P^0.3 (TD + 1)^0.06 A at 10 % spin-down, nominal pressure and the legal tread."""
    texture = (28.952 / film_in**0.06 - 7.817) * (TEXTURE_MM / MM_PER_INCH) ** 0.14
    a = max(10.409 / film_in**0.06 + 3.507, texture)
    return float(10.0**0.04 * _NOMINAL_PSI**0.3 * (LEGAL_TREAD_MM / 0.794 + 1.0) ** 0.06 * a)


def contact(film_mm: float, speed_mps: float, tyre_low: float = 0.0, tread_mm: float = LEGAL_TREAD_MM) -> float:
    """Share of the contact patch that still touches the road, in [MIN_CONTACT, 1]."""
    if film_mm <= 0.0:
        return 1.0
    lifted = (speed_mps / floating_speed_mps(film_mm, tyre_low, tread_mm)) ** 2
    return max(MIN_CONTACT, 1.0 - min(1.0, film_mm / DRAINED_MM) * lifted)


def speed_share(speed_mps: float) -> float:
    """What speed above 60 km/h leaves of wet friction, in (0, 1]."""
    slip_kmh = SLIP_SHARE * max(0.0, speed_mps * 3.6 - 60.0)
    return math.exp(-slip_kmh / (14.2 + 89.7 * MPD_MM))


def wet_low(film_mm: float, speed_mps: float, tyre_low: float = 0.0, tread_mm: float = LEGAL_TREAD_MM) -> float:
    """Least mu under a film, on a worn road with a worn tyre."""
    if film_mm <= 0.0:
        return DRY.low
    fallen = WET_LOW + (DRY.low - WET_LOW) * math.exp(-FALL_PER_MM * film_mm)
    lost = 1.0 - (1.0 - speed_share(speed_mps)) * (1.0 - math.exp(-FALL_PER_MM * film_mm))
    return fallen * lost * contact(film_mm, speed_mps, tyre_low, tread_mm)


def wet_high(film_mm: float) -> float:
    """Most mu under a film, on a good road at low speed."""
    return WET_HIGH + (DRY.high - WET_HIGH) * math.exp(-FALL_HIGH_PER_MM * max(0.0, film_mm))


def snow_low(warmest_c: float | None) -> float:
    """Least mu on snow of at most this temperature; unknown: near melting."""
    return between(0.0 if warmest_c is None else warmest_c, SNOW_LOW)
