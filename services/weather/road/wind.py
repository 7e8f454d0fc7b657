"""The speed at which a gust's side force takes no more than a share of the grip.

Side force: rho/2 A c (v^2 + w^2), w the gust from the side. The factor c rises nearly linearly with the angle of the
flow up to about 25 degrees and then flattens (Hucho, Aerodynamics of Road Vehicles): c = min(2.2 sin psi, 1), sin psi =
w / sqrt(v^2 + w^2). The equilibrium with grip is Baker's, A simplified analysis of various types of wind-induced road
vehicle accidents, J. Wind Eng. Ind. Aerodyn. 22 (1986).
"""

import math
from collections.abc import Sequence

from domain.kinematics import GRAVITY_MPS2
from services.weather.observations.observation import Observation

AIR_KG_M3, FRONT_M2, SIDE_PER_SINE = 1.25, 2.2, 2.2
"""A family car."""
MASS_KG = 1200.0
SIDE_SHARE = 0.35
"""Share of the grip that a gust may take: the rest is for steering and braking (ours)."""
GUST_RATIO = 1.6
"""Gust to mean wind in open country, where no gust is reported (ours; weather services use 1.5 to 1.7)."""
BRIDGE_RATIO = 1.2
"""A bridge stands in the open, in the faster wind above ground (ours)."""
LEAST_MPS = 13.9
"""Below 50 km/h the gust is nearly all of the flow: going slower still does not lessen the force (ours)."""


def gust_mps(observations: Sequence[Observation]) -> float | None:
    """The strongest gust that any source speaks for."""
    bridge = BRIDGE_RATIO if any(each.bridge for each in observations) else 1.0
    gusts = [each.gust_mps.high for each in observations if each.gust_mps is not None]
    gusts += [GUST_RATIO * each.wind_mps.high for each in observations if each.wind_mps is not None]
    return bridge * max(gusts) if gusts else None


def wind_speed_mps(mu_low: float, gust: float | None) -> float | None:
    """The speed at which the gust takes `SIDE_SHARE` of the grip, `LEAST_MPS` at least; None where there is no gust to speak of."""
    if gust is None or gust < 1.0:
        return None
    held = SIDE_SHARE * mu_low * MASS_KG * GRAVITY_MPS2 / (0.5 * AIR_KG_M3 * FRONT_M2)
    flow_squared = max(held, (held / (SIDE_PER_SINE * gust)) ** 2)
    return max(LEAST_MPS, math.sqrt(max(0.0, flow_squared - gust**2)))
