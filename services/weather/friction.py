"""What lies on the road, and how much braking friction it leaves: intervals of the peak coefficient mu.

Sources of the numbers:

* dry, wet, snow and ice: Wallman and Åström, Friction measurement methods and the correlation between road friction
  and traffic safety, VTI
  meddelande 911A (2001): dry bare 0.8 to 1.0, wet bare 0.7 to 0.8, packed snow 0.20 to 0.30, loose snow and slush 0.20
  to 0.50, black ice 0.15
  to 0.30, wet black ice 0.05 to 0.10. Our lower ends of dry and wet are below theirs, for worn roads and tyres: ours,
  provisional.
* the fall with the water film: friction stays near its dry value on a damp road, drops by 30 to 40 % within a few
  tenths of a millimetre, then
  flattens (Do, Cerezo, Beautru and Kane, Modeling of the connection road surface microtexture/water depth/friction,
  Wear 302, 2013).
* depth of the film in rain: Gallaway and others, Pavement and geometric design criteria for minimizing hydroplaning,
  FHWA-RD-79-31 (1979).
* speed at which a tyre floats: Huebner, Reed and Henry, Criteria for predicting hydroplaning potential, J. Transp.
  Eng. 112 (1986).
* lift below that speed grows with its square, and so does the lost part of the contact: Horne and Joyner, Pneumatic
  tire hydroplaning and some
  effects on vehicle performance, SAE 650145 (1965).
"""

from services.weather.interval import Interval, between

DRY = Interval(0.70, 0.95)
SNOW = Interval(0.15, 0.45)
ICE = Interval(0.05, 0.30)
"""From wet to cold black ice: which of them it is, no temperature sensor tells."""
FROST_LOW = 0.30
"""A dry road that may carry hoar frost."""
UNKNOWN = Interval(0.30, 0.95)
"""Nothing known: no lower than packed snow's best, no better than dry. Ice is assumed where cold is known, not where
nothing is.
"""

# Water film above the asperities (mm) -> mu of a worn and of a good road, before lift.
_LOW = ((0.0, DRY.low), (0.02, 0.55), (0.2, 0.45), (1.0, 0.38), (3.0, 0.30))
_HIGH = ((0.0, DRY.high), (0.02, 0.85), (0.2, 0.75), (1.0, 0.65), (3.0, 0.60))
MIN_CONTACT = 0.1
"""Even a floating tyre touches ridges and its neighbour axle."""

TEXTURE_MM, PATH_M, SLOPE_PERCENT = 0.8, 3.65, 2.5
"""Macrotexture of a used road; one lane drained at a usual crossfall."""
RUT_MM = 0.2
"""Allowance for ruts, in which water stands deeper than the formula says."""


def rain_film_mm(rain_mm_h: float) -> float:
    """Water above the asperities in steady rain (mm), ruts included: Gallaway's WD = 0.103 T^0.11 L^0.43 I^0.59 /
    S^0.42 - T.
    """
    if rain_mm_h <= 0.0:
        return 0.0
    depth: float = 0.103 * TEXTURE_MM**0.11 * PATH_M**0.43 * rain_mm_h**0.59 / SLOPE_PERCENT**0.42 - TEXTURE_MM
    return max(0.0, depth) + RUT_MM * min(1.0, rain_mm_h / 5.0)


def floating_speed_mps(film_mm: float, tyre_low: float = 0.0) -> float:
    """Speed at which a tyre floats: 26.04 WD^-0.259 (mph, inches), for films up to 2.4 mm.

    `tyre_low` in [0, 1]: how soft the tyres are. The speed goes with the root of the pressure (Horne and Dreher, NASA
    TN D-2056, 1963); 1 is half
    the nominal pressure.
    """
    film_in = min(max(film_mm, 0.01), 2.4) / 25.4
    speed: float = 26.04 * film_in**-0.259 * 0.44704 * (1.0 - 0.5 * tyre_low) ** 0.5
    return speed


def contact(film_mm: float, speed_mps: float, tyre_low: float = 0.0) -> float:
    """Share of the contact patch that still touches the road, in [MIN_CONTACT, 1]."""
    if film_mm <= 0.0:
        return 1.0
    return max(MIN_CONTACT, 1.0 - (speed_mps / floating_speed_mps(film_mm, tyre_low)) ** 2)


def wet(film: Interval, speed_mps: float, tyre_low: float = 0.0) -> Interval:
    """mu under a water film of `film` mm: the worn road with the deeper film below, the good road with the thinner
    one above.
    """
    low = between(film.high, _LOW) * contact(film.high, speed_mps, tyre_low)
    return Interval(low, max(low, between(film.low, _HIGH)))


def frozen(base: Interval, road_c: Interval, *, wet_possible: bool) -> Interval:
    """`base` where the road's temperature may be, or surely is, at or below freezing."""
    if road_c.low > 1.0:
        return base
    if not wet_possible:
        return Interval(min(base.low, FROST_LOW), base.high)
    return Interval(min(base.low, ICE.low), ICE.high if road_c.high <= 0.0 else base.high)
