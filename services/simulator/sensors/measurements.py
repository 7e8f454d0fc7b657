"""Measurements of a snapshot: LiDAR, position, weather sensing, the map's view, the car's own state."""

import math
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np

from proto.sensors import Calibration, GnssFix, LanePath, LidarSweep, MapView, StopLine, WeatherSensing
from services.simulator.car.state import Controls
from services.simulator.environment.weather import Weather
from services.simulator.road.route import Route
from services.simulator.road.stop_lines import Line
from services.simulator.scene.scene import CameraSpec, Pose, StaticWorld, in_ego_frame
from services.simulator.scene.solids import Solid, solids
from services.simulator.sensors import lidar
from services.simulator.truth.snapshot import Snapshot

LIDAR_REACH_M, STATIC_REACH_M = 90.0, 55.0
CROSSING_M, ACROSS_MPS = 75.0, 2.0
"""So near, and so fast across the ego's heading, a vehicle crosses."""
MAP_BEHIND_M, MAP_AHEAD_M, MAP_EVERY_M = 10.0, 120.0, 6.0
JUNCTION_SEEN_M = 150.0
GNSS_SIGMA_M, HEADING_SIGMA_RAD = 0.6, 0.01
_LINE_KINDS: dict[str, Literal["stop_line", "light", "yield_line"]] = {
    "light": "light",
    "stop_line": "stop_line",
    "yield": "yield_line",
}
WIPERS_FROM_MM_H = (0.2, 2.0, 8.0)


class SensorNoise:
    """One stream of chance per sensor and instant, so that leaving one sensor out does not change the others."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def at(self, sensor: int, step: int) -> np.random.Generator:
        """The stream of a sensor at a step."""
        return np.random.default_rng([self._seed, 50 + sensor, step])


class StaticBoxes:
    """What stands still as boxes, and which of them are near."""

    def __init__(self, static: StaticWorld) -> None:
        self._solids = list(solids(static))
        self._places = np.array([[each.pose.x_m, each.pose.y_m] for each in self._solids]).reshape(-1, 2)

    def near(self, ego: Pose) -> list[lidar.BoxOnGround]:
        """Boxes within ``STATIC_REACH_M``, in the ego frame."""
        away = np.hypot(self._places[:, 0] - ego.x_m, self._places[:, 1] - ego.y_m)
        return [_solid(ego, self._solids[index]) for index in np.nonzero(away < STATIC_REACH_M)[0]]


def _solid(ego: Pose, solid: Solid) -> lidar.BoxOnGround:
    return _box(ego, solid.pose, (solid.length_m, solid.width_m, solid.top_m), solid.base_m)


def _box(ego: Pose, pose: Pose, size: tuple[float, float, float], base_m: float = 0.0) -> lidar.BoxOnGround:
    x, y = in_ego_frame(ego, pose.x_m, pose.y_m)
    return lidar.BoxOnGround(x, y, pose.yaw_rad - ego.yaw_rad, *size, base_m)


def lidar_sweep(snapshot: Snapshot, static: StaticBoxes, noise: SensorNoise) -> LidarSweep:
    """The LiDAR's turn at a moment."""
    ego = snapshot.ego.pose
    boxes = static.near(ego)
    for actor in snapshot.scene.actors:
        box = _box(ego, actor.pose, (actor.length_m, actor.width_m, actor.height_m))
        if math.hypot(box.x_m, box.y_m) < LIDAR_REACH_M:
            boxes.append(box)
    points = lidar.sweep(boxes, snapshot.weather.rain_mm_h, noise.at(1, snapshot.step))
    return LidarSweep(points=points.astype("<f4").tobytes(), count=len(points), rings=lidar.RINGS)


def somebody_crosses(snapshot: Snapshot) -> bool:
    """Whether a vehicle that LiDAR may show drives across the ego's way, or turns into it."""
    ego = snapshot.ego.pose
    near = {
        actor.id
        for actor in snapshot.scene.actors
        if actor.kind != "pedestrian" and math.hypot(actor.pose.x_m - ego.x_m, actor.pose.y_m - ego.y_m) < CROSSING_M
    }
    c, s = math.cos(ego.yaw_rad), math.sin(ego.yaw_rad)
    return any(
        mover.actor_id in near and abs(c * mover.vy_mps - s * mover.vx_mps) > ACROSS_MPS for mover in snapshot.movers
    )


def gnss_fix(snapshot: Snapshot, noise: SensorNoise) -> GnssFix:
    """A noisy position; the error drifts slowly, as a receiver's does."""
    chance, pose, t = noise.at(2, snapshot.step), snapshot.ego.pose, snapshot.time_s
    drift = 0.4 * math.sin(t / 17.0), 0.4 * math.cos(t / 23.0)
    x, y = chance.normal(0.0, GNSS_SIGMA_M / 2, 2)
    heading = pose.yaw_rad + float(chance.normal(0.0, HEADING_SIGMA_RAD))
    return GnssFix(
        x_m=pose.x_m + drift[0] + float(x),
        y_m=pose.y_m + drift[1] + float(y),
        heading_rad=math.remainder(heading, 2 * math.pi),
        sigma_m=GNSS_SIGMA_M,
    )


def weather_sensing(snapshot: Snapshot, noise: SensorNoise) -> WeatherSensing:
    """What the rain sensor, thermometers and the road sensor report; never friction."""
    return sensed(snapshot.weather, noise.at(3, snapshot.step))


def sensed(weather: Weather, chance: np.random.Generator) -> WeatherSensing:
    """A weather as its sensors have it."""
    wobble = 1.0 + 0.08 * chance.standard_normal(4)
    return WeatherSensing(
        rain_mm_h=max(0.0, weather.rain_mm_h * float(wobble[0])),
        snow_mm_h=max(0.0, weather.snow_mm_h * float(wobble[0])),
        visibility_m=max(10.0, weather.visibility_m * float(wobble[1])),
        air_temperature_c=weather.air_c + 0.2 * float(chance.standard_normal()),
        road_temperature_c=weather.road_c + 0.4 * float(chance.standard_normal()),
        water_film_mm=max(0.0, weather.film_mm * float(wobble[2])),
        wind_mps=max(0.0, weather.wind_mps * float(wobble[3])),
        gust_mps=max(0.0, weather.gust_mps * float(wobble[3])),
        dew_point_c=weather.dew_point_c + 0.2 * float(chance.standard_normal()),
    )


def map_view(snapshot: Snapshot, route: Route, lines: Sequence[Line]) -> MapView:
    """Lanes, stop lines and the next junction; nothing of what signs say."""
    ego, stretch = snapshot.ego, route.stretch_at(snapshot.ego.s_m)
    junction = next((at - ego.s_m for at in route.junctions() if 0.0 < at - ego.s_m < JUNCTION_SEEN_M), None)
    return MapView(
        segment_id=_segment(route, ego.s_m),
        lanes=tuple(_lane_paths(snapshot, route)),
        stop_lines=tuple(_stop_lines(ego.s_m, route, lines)),
        junction_distance_m=junction,
        carriageways_separated=route.section.median_m > 1.0,
        road_class=stretch.road_class,
    )


def _segment(route: Route, s_m: float) -> str:
    """A segment reaches from junction to junction, or to where the road changes its kind."""
    cuts = sorted({*route.junctions(), *(stretch.from_m for stretch in route.scenario.road.stretches)})
    return f"{route.scenario.name}/{sum(1 for cut in cuts if cut <= s_m)}"


def _lane_paths(snapshot: Snapshot, route: Route) -> Iterable[LanePath]:
    ego, section = snapshot.ego, route.section
    low, high = max(0.0, ego.s_m - MAP_BEHIND_M), min(route.length_m, ego.s_m + MAP_AHEAD_M)
    s = np.linspace(low, high, max(2, int((high - low) / MAP_EVERY_M) + 1))
    c, sine = math.cos(ego.pose.yaw_rad), math.sin(ego.pose.yaw_rad)
    to_ego = np.array([[c, -sine], [sine, c]])
    for forward in (True, False):
        for lane in range(section.lanes):
            offsets = section.offset_m(s, "forward" if forward else "oncoming", lane)
            points = (section.spine.places(s, offsets) - (ego.pose.x_m, ego.pose.y_m)) @ to_ego
            yield LanePath(
                lane_id=f"{'f' if forward else 'o'}{lane}",
                points=tuple([(round(x, 2), round(y, 2)) for x, y in points.tolist()]),
                width_m=section.lane_width_m,
                is_ego=forward and lane == ego.lane,
                oncoming=not forward,
            )


def _stop_lines(s_m: float, route: Route, lines: Sequence[Line]) -> Iterable[StopLine]:
    for line in lines:
        marked = line.kind != "yield" or route.scenario.yields[line.ordinal].sign
        if marked and -2.0 < line.at_m - s_m < JUNCTION_SEEN_M:
            yield StopLine(distance_m=line.at_m - s_m, kind=_LINE_KINDS[line.kind])
    for zebra in route.scenario.zebras:
        if -2.0 < zebra.at_m - s_m < JUNCTION_SEEN_M:
            yield StopLine(distance_m=zebra.at_m - s_m - 2.5, kind="crossing")


def car_controls(snapshot: Snapshot) -> Controls:
    """What the car's control units are told."""
    ego, weather, atmosphere = snapshot.ego, snapshot.weather, snapshot.scene.atmosphere
    dark = atmosphere.night or atmosphere.sun_elevation_deg < 4.0
    return Controls(
        speed_mps=ego.speed_mps,
        acceleration_mps2=ego.acceleration_mps2,
        yaw_rate_radps=ego.yaw_rate_radps,
        road_wheel_rad=ego.road_wheel_rad,
        accelerator=snapshot.wish.accelerator,
        brake=snapshot.wish.brake,
        system_brake=min(1.0, snapshot.brake.applied_mps2 / 8.0),
        abs_active=ego.abs_active,
        locked=ego.locked,
        mu=ego.mu,
        wiper_stage=wiper_stage(max(weather.rain_mm_h, weather.snow_mm_h)),
        rain_mm_h=max(weather.rain_mm_h, weather.snow_mm_h),
        light_lx=light_lx(atmosphere.sun_elevation_deg, weather.cloud),
        outside_temperature_c=weather.air_c,
        headlamps=2 if dark or weather.rain_mm_h > 1.0 or weather.visibility_m < 1500.0 else 0,
        fog_rear=weather.visibility_m < 50.0,
    )


def wiper_stage(rain_mm_h: float) -> int:
    """The stage that an automatic wiper chooses."""
    return sum(1 for threshold in WIPERS_FROM_MM_H if rain_mm_h >= threshold)


def light_lx(sun_elevation_deg: float, cloud: float) -> float:
    """What the light sensor behind the windscreen gets: 100,000 lx under a high clear sun, a tenth under a full cover,
    some 400 lx at sunrise, under 1 lx at night.
    """
    clear = 100_000.0 * math.sin(math.radians(sun_elevation_deg)) if sun_elevation_deg > 0.0 else 0.0
    dusk = 400.0 * math.exp(min(0.0, sun_elevation_deg) / 1.5)
    return min(clear + dusk, 120_000.0) * (1.0 - 0.9 * cloud)


def calibration(camera: CameraSpec) -> Calibration:
    """A camera's pinhole and mount."""
    return Calibration(
        fx_px=camera.focal_px,
        fy_px=camera.focal_px,
        cx_px=camera.width_px / 2,
        cy_px=camera.height_px / 2,
        width_px=camera.width_px,
        height_px=camera.height_px,
        x_m=camera.x_m,
        y_m=camera.y_m,
        z_m=camera.z_m,
        pitch_rad=camera.pitch_rad,
    )
