"""Water, snow and ice on the road second by second, and the friction that follows, on a road drawn by the seed.

The numbers are ours, chosen after the published ranges (see docs/explanation/weather.md), and not those that Weather estimates
with: another shape, another road per seed, a tread that Weather does not know. A road here is the whole route.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

WETTING_S, DRYING_S = 30.0, 240.0
FOG_DAMP_M, DEW_MM, FOG_MM = 300.0, 0.03, 0.02
FREEZES_C, SALTED_FREEZES_C = -0.3, -6.0
ICE_PER_S_K, ICE_MOST_PER_S = 0.001, 0.02
FROST_MM_PER_S_K = 4e-6
MELT_MM_PER_S_K, MELTS_FROM_C, SLUSH_MM = 4e-4, 0.3, 0.3
LEAST_MU = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Road:
    """One road and the tyres on it; as it stands here, the average one."""

    dry: float = 0.85
    drop: float = 0.30
    """mu lost to a film that lubricates fully, most of it within `drop_mm`."""
    drop_mm: float = 0.08
    deep: float = 0.13
    """mu lost to each further millimetre, up to one."""
    fast: float = 0.07
    """mu lost on water at 30 m/s."""
    tread_mm: float = 4.5
    salted: bool = False


def draw_road(seed: int) -> Road:
    """The road of a seed."""
    chance = np.random.default_rng([seed, 61])
    return Road(
        dry=float(chance.triangular(0.72, 0.85, 0.96)),
        drop=float(chance.triangular(0.20, 0.30, 0.36)),
        drop_mm=float(chance.uniform(0.05, 0.14)),
        deep=float(chance.uniform(0.05, 0.17)),
        fast=float(chance.uniform(0.03, 0.11)),
        tread_mm=float(chance.uniform(1.8, 8.0)),
        salted=bool(chance.random() < 0.3),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Sky:
    """Precipitation on the road, and its temperature."""

    rain_mm_h: float = 0.0
    snow_mm_h: float = 0.0
    visibility_m: float = 20_000.0
    road_c: float = 12.0
    dew_point_c: float = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover:
    """Cover of the road, in millimetres of water."""

    film_mm: float = 0.0
    snow_mm: float = 0.0
    ice_mm: float = 0.0
    frost_mm: float = 0.0

    def after(self, sky: Sky, road: Road, dt: float) -> "Cover":
        """The cover a moment later."""
        return self._melted(sky, dt)._frozen(sky, road, dt)._wetted(sky, road, dt)

    def _wetted(self, sky: Sky, road: Road, dt: float) -> "Cover":
        frozen = sky.road_c < freezes_c(road)
        target = wet_film_mm(sky) if not frozen or sky.rain_mm_h > 0.0 else 0.0
        if self.snow_mm > 0.05 and sky.road_c > MELTS_FROM_C:
            target = max(target, SLUSH_MM)
        film = self.film_mm + (target - self.film_mm) * dt / (WETTING_S if target > self.film_mm else DRYING_S)
        fallen = sky.snow_mm_h / 3600.0 * dt if sky.road_c < 2.0 else 0.0
        return replace(self, film_mm=film, snow_mm=self.snow_mm + fallen)

    def _frozen(self, sky: Sky, road: Road, dt: float) -> "Cover":
        below = freezes_c(road) - sky.road_c
        if below <= 0.0:
            return self
        turned = self.film_mm * min(ICE_MOST_PER_S, ICE_PER_S_K * (1.0 + below)) * dt
        settled = FROST_MM_PER_S_K * max(0.0, sky.dew_point_c - sky.road_c) * dt
        return replace(
            self,
            film_mm=self.film_mm - turned,
            ice_mm=self.ice_mm + turned,
            frost_mm=self.frost_mm + (0.0 if road.salted else settled),
        )

    def _melted(self, sky: Sky, dt: float) -> "Cover":
        gone = MELT_MM_PER_S_K * max(0.0, sky.road_c - MELTS_FROM_C) * dt
        if gone <= 0.0:
            return self
        return replace(
            self,
            snow_mm=max(0.0, self.snow_mm - gone),
            ice_mm=max(0.0, self.ice_mm - gone),
            frost_mm=max(0.0, self.frost_mm - gone),
        )


def freezes_c(road: Road) -> float:
    """Where water on this road freezes."""
    return SALTED_FREEZES_C if road.salted else FREEZES_C


def wet_film_mm(sky: Sky) -> float:
    """The film that this sky keeps up in the end."""
    dew = DEW_MM if sky.dew_point_c >= sky.road_c else 0.0
    fog = FOG_MM if sky.visibility_m < FOG_DAMP_M else 0.0
    return max(float(0.09 * sky.rain_mm_h**0.65), dew, fog)


def friction(cover: Cover, road: Road, road_c: float, speed_mps: float) -> float:
    """mu under sound tyres at a speed, forwards or backwards: water first, then frost, snow and ice over their shares of the ground."""
    mu = _wet(cover.film_mm, road, abs(speed_mps))
    cold = min(0.0, road_c)
    for depth_mm, covers_mm, melting, colder, per_k in (
        (cover.frost_mm, 0.04, 0.36, 0.10, 3.0),
        (cover.snow_mm, 0.6, 0.30, 0.11, 4.0),
        (cover.ice_mm, 0.04, 0.19, 0.10, 3.0),
    ):
        if depth_mm == 0.0:
            continue
        slippery = melting - colder * math.exp(cold / per_k)
        share = 1.0 - math.exp(-depth_mm / covers_mm)
        mu += share * (min(mu, slippery + 0.15 * (road.dry - 0.85)) - mu)
    return max(LEAST_MU, mu)


def _wet(film_mm: float, road: Road, speed_mps: float) -> float:
    lubricated = 1.0 - math.exp(-film_mm / road.drop_mm)
    mu = road.dry - road.drop * lubricated - road.deep * min(film_mm, 1.0)
    mu -= road.fast * lubricated * (speed_mps / 30.0) ** 1.3
    floats_mps = 36.0 - 9.0 * math.log10(max(film_mm, 0.05) / 0.3) + 1.2 * (road.tread_mm - 4.5)
    touching: float = 1.0 / (1.0 + math.exp((speed_mps - floats_mps) / 2.2))
    return float(LEAST_MU + (mu - LEAST_MU) * (touching if film_mm > 0.05 else 1.0))
