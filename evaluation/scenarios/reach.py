"""What can still be avoided: a driver who reacts after 1.5 s and brakes at 4 m/s2."""

REACTION_S, BRAKING_MPS2 = 1.5, 4.0
HEADWAY_S = 1.3
"""What drivers keep to the vehicle ahead (the median of the simulated population)."""


def stop_m(speed_mps: float) -> float:
    """The way to a standstill; with a closing speed, the gap that is used up."""
    return speed_mps * REACTION_S + speed_mps**2 / (2.0 * BRAKING_MPS2)


def behind_m(speed_mps: float, lead_brakes_mps2: float) -> float:
    """The gap one needs to a vehicle ahead, equally fast, that brakes to a standstill."""
    return stop_m(speed_mps) - speed_mps**2 / (2.0 * lead_brakes_mps2)


def sight_in_bend_m(radius_m: float, beside_m: float) -> float:
    """How far one sees along a bend past what stands `beside_m` from the middle of the lane, on the inner side."""
    return float((8.0 * radius_m * beside_m) ** 0.5)
