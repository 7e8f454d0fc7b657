"""From the atmosphere to the numbers the shaders light with. Colours are linear (squared) RGB."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from services.simulator.scene.scene import Atmosphere

Rgb = tuple[float, float, float]
KOSCHMIEDER = 3.912  # contrast falls to 2 % at the visibility distance
HEADLIGHT_GAIN = 1.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """What every shader needs to know of weather and light."""

    sun_dir: Rgb
    sun: Rgb
    sky: Rgb
    earth: Rgb
    zenith: Rgb
    horizon: Rgb
    fog: Rgb
    beta: float  # extinction per metre
    haze: float  # 0 to 1: how much the sky drowns in it
    cloud: float
    night: float
    wet: float
    shadow: float  # strength of the sun's shadows
    noise: float
    gain: float


def _mix(a: Rgb, b: Rgb, t: float) -> Rgb:
    r, g, bl = (x + (y - x) * t for x, y in zip(a, b, strict=True))
    return r, g, bl


def _scaled(colour: Rgb, factor: float) -> Rgb:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def extinction_per_m(atmosphere: Atmosphere) -> float:
    """Fog by visibility (Koschmieder); rain by its rate, 0.29 R ** 0.63 per km for R in mm/h, doubled for its spray."""
    rain = 2 * 0.29e-3 * atmosphere.rain_mm_h**0.63 if atmosphere.rain_mm_h > 0 else 0.0
    return KOSCHMIEDER / max(atmosphere.fog_visibility_m, 5.0) + rain


def light_of(atmosphere: Atmosphere) -> Light:
    """All light numbers for an atmosphere."""
    beta = extinction_per_m(atmosphere)
    haze = float(np.clip(beta * 160, 0.0, 1.0))
    cloud = max(atmosphere.cloud, min(1.0, atmosphere.rain_mm_h / 4), haze * 0.9)
    wet = max(atmosphere.wetness, min(1.0, atmosphere.rain_mm_h / 5))
    return _night(atmosphere, beta, haze, wet) if atmosphere.night else _day(atmosphere, beta, haze, cloud, wet)


def _day(atmosphere: Atmosphere, beta: float, haze: float, cloud: float, wet: float) -> Light:
    height = math.radians(max(atmosphere.sun_elevation_deg, 1.5))
    low = float(np.clip(1 - atmosphere.sun_elevation_deg / 22, 0, 1))
    open_sky = (1 - cloud) ** 1.2
    warm = _mix((1.0, 0.95, 0.86), (1.0, 0.60, 0.28), low)
    strength = open_sky * (1.25 - 0.35 * low)
    grey = 1 - 0.30 * min(atmosphere.rain_mm_h / 12, 1) - 0.25 * low
    sky = _scaled(_mix((0.42, 0.50, 0.64), (0.72, 0.73, 0.75), cloud), grey)
    zenith = _scaled(_mix((0.10, 0.24, 0.55), (0.42, 0.44, 0.47), cloud), grey)
    pale = _mix((0.55, 0.66, 0.80), (0.60, 0.62, 0.65), cloud)
    horizon = _scaled(_mix(pale, (0.85, 0.58, 0.38), low * open_sky), grey)
    return Light(
        sun_dir=(
            math.cos(height) * math.cos(atmosphere.sun_azimuth_rad),
            math.cos(height) * math.sin(atmosphere.sun_azimuth_rad),
            math.sin(height),
        ),
        sun=_scaled(warm, strength),
        sky=sky,
        earth=_scaled(sky, 0.55),
        zenith=zenith,
        horizon=horizon,
        fog=_mix(horizon, _scaled((0.60, 0.61, 0.63), grey), haze),
        beta=beta,
        haze=haze,
        cloud=cloud,
        night=0.0,
        wet=wet,
        shadow=0.58 * open_sky,
        noise=0.022 + 0.012 * haze,
        gain=1.0,
    )


def _night(atmosphere: Atmosphere, beta: float, haze: float, wet: float) -> Light:
    glow = 0.6 + 0.8 * haze
    sky: Rgb = (0.016, 0.018, 0.026)
    horizon = _scaled((0.030, 0.029, 0.034), glow)
    return Light(
        sun_dir=(0.3, 0.2, 0.93),
        sun=(0.004, 0.005, 0.008),
        sky=sky,
        earth=_scaled(sky, 0.6),
        zenith=(0.004, 0.005, 0.011),
        horizon=horizon,
        fog=horizon,
        beta=beta,
        haze=haze,
        cloud=max(atmosphere.cloud, 0.3),
        night=1.0,
        wet=wet,
        shadow=0.0,
        noise=0.055,
        gain=1.0,
    )
