"""The speed at which a gust's side force takes no more than a share of the grip.

Side force: rho/2 A c psi (v^2 + w^2), with psi = w / sqrt(v^2 + w^2) the angle of the flow (sideways gust), so
k w sqrt(v^2 + w^2); c is nearly linear in psi up to about 25 degrees (Hucho, Aerodynamics of Road Vehicles; the
equilibrium is Baker's, A simplified analysis of various types of wind-induced road vehicle accidents, J. Wind Eng.
Ind. Aerodyn. 22, 1986).
"""

import math
from collections.abc import Sequence

from services.weather.observation import Observation

AIR_KG_M3, FRONT_M2, SIDE_PER_RAD = 1.25, 2.2, 2.2
"""A family car."""
MASS_KG = 1200.0
SIDE_SHARE = 0.3
"""Share of the grip that a gust may take: the rest is for steering and braking (ours)."""
GUST_RATIO = 1.6
"""Gust to mean wind in open country, where no gust is reported (ours; weather services use 1.5 to 1.7)."""
BRIDGE_RATIO = 1.2
"""A bridge stands in the open, in the faster wind above ground (ours)."""
G_MPS2 = 9.81


def gust_mps(observations: Sequence[Observation]) -> float | None:
    """The strongest gust that any source speaks for."""
    bridge = BRIDGE_RATIO if any(each.bridge for each in observations) else 1.0
    gusts = [each.gust_mps.high for each in observations if each.gust_mps is not None]
    gusts += [GUST_RATIO * each.wind_mps.high for each in observations if each.wind_mps is not None]
    return bridge * max(gusts) if gusts else None


def wind_speed_mps(mu_low: float, gust: float | None) -> float | None:
    """The speed at which the gust takes `SIDE_SHARE` of the grip; None where there is no gust to speak of."""
    if gust is None or gust < 1.0:
        return None
    flow = SIDE_SHARE * mu_low * MASS_KG * G_MPS2 / (0.5 * AIR_KG_M3 * FRONT_M2 * SIDE_PER_RAD * gust)
    return math.sqrt(max(0.0, flow**2 - gust**2))
