"""The Weather service: gathers what weather sensing and the car report, publishes conditions, offers the assessment
as a tool.
"""

from typing import Annotated

import msgspec

from domain.kinematics import GRAVITY_MPS2
from drivemcp.bus.received import Received
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.node import Node
from drivemcp.service import Service
from proto import topics
from proto.sensors import WeatherSensing
from proto.vehicle import Ego
from proto.weather import Conditions
from services.weather.assess import assess
from services.weather.memory import Memory
from services.weather.observations.observation import Observation
from services.weather.road.car import Car
from services.weather.road.slip import Braking
from services.weather.senses import from_camera, from_car, from_sensing, suppose, supposing, tyre_low
from services.weather.sources.internet import Internet, InternetConfig, providers

NS = 1_000_000_000
ABS_DECELERATION_MPS2 = 0.3
"""Below this an anti-lock system at work says nothing of grip: the car hardly brakes."""

Rain = Annotated[float, msgspec.Meta(ge=0.0, description="rain, mm/h", examples=[4.0])]
Snow = Annotated[float, msgspec.Meta(ge=0.0, description="snowfall as water, mm/h", examples=[1.0])]
Sight = Annotated[float, msgspec.Meta(ge=0.0, description="visibility, m", examples=[150.0])]
Air = Annotated[float, msgspec.Meta(ge=-90.0, le=70.0, description="air temperature, degC", examples=[2.0])]
Road = Annotated[float, msgspec.Meta(ge=-90.0, le=90.0, description="road temperature, degC", examples=[-1.0])]
Film = Annotated[float, msgspec.Meta(ge=0.0, description="water film on the road, mm", examples=[0.5])]
Stage = Annotated[int, msgspec.Meta(ge=0, le=3, description="wiper stage, 0 to 3", examples=[2])]
Speed = Annotated[
    float, msgspec.Meta(ge=0.0, description="speed to judge grip at, m/s; unset: the ego's", examples=[27.8])
]
Limit = Annotated[
    float, msgspec.Meta(ge=0.0, description="limit that the speed factor will scale, m/s", examples=[33.3])
]


class WeatherConfig(ServiceConfig, frozen=True, kw_only=True):
    """How often conditions are published, and how old an input may be."""

    conditions_hz: float = 2.0
    """How often `conditions` is published."""
    sensing_max_age_s: float = 5.0
    """Weather sensing older than this is not used."""
    ego_max_age_s: float = 1.0
    """Ego data older than this are not used."""
    degradation_max_age_s: float = 5.0
    """The car's health older than this is not used."""
    camera_max_age_s: float = 5.0
    """The camera's weather older than this is not used."""
    internet: InternetConfig = InternetConfig()


class _Inputs:
    """The newest messages, judged by age when they are read."""

    def __init__(self, config: WeatherConfig, node: Node) -> None:
        self._config, self._node = config, node
        node.subscribe(topics.WEATHER_SENSING)
        node.subscribe(topics.EGO, self._on_ego)
        node.subscribe(topics.DEGRADATION)
        node.subscribe(topics.CAMERA_WEATHER)
        self._braking = Braking()
        self._internet = _internet(config, node)
        self._abs: tuple[float, int] | None = None

    def _on_ego(self, ego: Ego, info: object) -> None:
        deceleration = -(ego.acceleration_mps2 or 0.0)
        if ego.abs_active and deceleration > ABS_DECELERATION_MPS2:
            self._abs = (deceleration / GRAVITY_MPS2, self._node.clock.now_ns())
        self._braking.add(ego, self._node.clock.now_ns())

    def observations(self, now_ns: int) -> tuple[Observation, ...]:
        """What each source says now."""
        sensing = self._received(topics.WEATHER_SENSING, self._config.sensing_max_age_s, now_ns)
        ego = self._received(topics.EGO, self._config.ego_max_age_s, now_ns)
        found = [] if sensing is None else [from_sensing(sensing.message, sensing.stamp_ns)]
        if ego is not None:
            found.append(
                from_car(ego.message, self._abs_mu(now_ns), ego.stamp_ns, braking=self._braking.friction(now_ns))
            )
        camera = self._received(topics.CAMERA_WEATHER, self._config.camera_max_age_s, now_ns)
        if camera is not None:
            found.append(from_camera(camera.message, camera.stamp_ns))
        if self._internet is not None:
            found += self._internet.observations(now_ns)
            self._node.detail.update(self._internet.status)
        return tuple(found)

    def car(self, now_ns: int, before: Car) -> Car:
        """What the car brings now; `before`: as it last was."""
        ego = self._received(topics.EGO, self._config.ego_max_age_s, now_ns)
        health = self._received(topics.DEGRADATION, self._config.degradation_max_age_s, now_ns)
        return Car(
            speed_mps=None if ego is None else ego.message.speed_mps,
            tyre_low=None if health is None else tyre_low(health.message, before.tyre_low),
            brake_envelope=None if health is None else health.message.brake_envelope,
        )

    def _abs_mu(self, now_ns: int) -> float | None:
        if self._abs is None or now_ns - self._abs[1] > NS:
            return None
        return self._abs[0]

    def _received(self, topic: topics.Topic[topics.M], max_age_s: float, now_ns: int) -> Received[topics.M] | None:
        received = self._node.latest(topic)
        if received is None or abs(now_ns - received.stamp_ns) > max_age_s * NS:
            return None
        return received


def _internet(config: WeatherConfig, node: Node) -> Internet | None:
    """The weather services that were asked for, running; None where none was."""
    if not config.internet.providers:
        return None
    if config.lockstep:
        raise ConfigError("internet.providers: weather from the internet is of today, and a lockstep drive is not")
    internet = Internet(config.internet, providers(config.internet), node.clock.now_ns)
    node.on_close(internet.close)
    internet.start()
    return internet


def build(config: WeatherConfig, node: Node) -> None:
    """Wire inputs, publication and tool."""
    inputs = _Inputs(config, node)
    state = {"memory": Memory()}

    def publish() -> None:
        now_ns, before = node.clock.now_ns(), state["memory"]
        assessed = assess(inputs.observations(now_ns), inputs.car(now_ns, before.car), before, now_ns)
        state["memory"] = assessed.memory
        node.publish(topics.CONDITIONS, assessed.conditions)

    node.every(1.0 / config.conditions_hz, publish)

    @node.tool(deadline_ms=40)
    def assess_weather(
        rain_mm_h: Rain | None = None,
        snow_mm_h: Snow | None = None,
        visibility_m: Sight | None = None,
        air_temperature_c: Air | None = None,
        road_temperature_c: Road | None = None,
        water_film_mm: Film | None = None,
        wiper_stage: Stage | None = None,
        speed_mps: Speed | None = None,
        limit_mps: Limit | None = None,
    ) -> Conditions:
        """Grip, sight and risk here and now, and what they ask of speed and following distance.

        An argument takes the place of what is sensed, for a question of the kind "what if"; without arguments it is the
        weather as it is.
        """
        now_ns, before = node.clock.now_ns(), state["memory"]
        asked = WeatherSensing(
            rain_mm_h=rain_mm_h,
            snow_mm_h=snow_mm_h,
            visibility_m=visibility_m,
            air_temperature_c=air_temperature_c,
            road_temperature_c=road_temperature_c,
            water_film_mm=water_film_mm,
        )
        observations = suppose(inputs.observations(now_ns), asked, wiper_stage, now_ns)
        car = inputs.car(now_ns, before.car)
        if speed_mps is not None:
            car = msgspec.structs.replace(car, speed_mps=speed_mps)
        memory = supposing(before, observations)
        return assess(observations, car, memory, now_ns, limit_mps).conditions


SERVICE = Service("weather", WeatherConfig, build)
