"""The simulated world, step by step at 20 Hz: highway-env moves the vehicles, the rest is ours. Bit-identical per seed.

A step reads the commands that reached the car and its driver since the last one, and gives a ``Snapshot``.
"""

import math
from dataclasses import dataclass, replace

from proto.decision import BrakeCommand
from services.simulator.car import tyres
from services.simulator.car.brake_receiver import Brake, Controls
from services.simulator.car.braking import Ability, Braked, asked_for, decelerate
from services.simulator.car.kinematics import FREE, bend_speed_mps
from services.simulator.driver.driver import Advice, DriverView, pedals
from services.simulator.driver.kinds import DriverKind, new_driver
from services.simulator.driver.profile import understands
from services.simulator.driver.road_ahead import RoadAhead
from services.simulator.environment.scenery import build_parked, build_scenery
from services.simulator.environment.weather import Weather, WeatherCourse, atmosphere
from services.simulator.people.pedestrians import PERSON_IDS, Person, Surroundings, populate, step_person
from services.simulator.road.furniture import build_gantries, build_lights, build_signs
from services.simulator.road.gantries import LOOKS_AHEAD_M, Comes, at_start, decide
from services.simulator.road.highway_env_road import build_road, direction_of, lane_index, to_pose
from services.simulator.road.layout import build_flat
from services.simulator.road.route import Route
from services.simulator.road.stop_lines import Cycle, Lights, LineKind, build_lines
from services.simulator.scenario.law import Legal, build_law
from services.simulator.scenario.plan import RoadClass, Scenario
from services.simulator.scene.scene import Box, Pose, Scene, StaticWorld
from services.simulator.sensors import camera_scene
from services.simulator.traffic.cars import Car, Ego
from services.simulator.traffic.cross_traffic import CrossCar, CrossTraffic
from services.simulator.traffic.flow import Traffic
from services.simulator.truth.hazard_sources import HazardSources
from services.simulator.truth.hazards import Hazard, HazardLog
from services.simulator.truth.ledger import Crossed, Ledger
from services.simulator.truth.line_of_sight import Sight, houses
from services.simulator.truth.snapshot import EgoMotion, Mover, Snapshot

STEP_S = 0.05
SEES_LEAD_M = 160.0
SEES_CROSS_M = 80.0
LIGHTS_BELOW_M = 1500.0
UNLIT_M, WIPERS_NEEDED_MM_H = 40.0, 0.2
RECYCLE_EVERY, LAW_EVERY = 10, 5
END_BEFORE_M = 60.0
WRECKED_S = 5.0
"""So long after a collision with a vehicle, also one out of a side road, the drive is over."""
SENSE_MPS: dict[RoadClass, float] = {"urban": 62 / 3.6, "rural": 105 / 3.6, "motorway": 150 / 3.6}


@dataclass(frozen=True, slots=True)
class Inputs:
    """Input to a step: spoken advice and braking commands since the last one, and the car's ability to brake."""

    advice: tuple[Advice, ...] = ()
    brakes: tuple[BrakeCommand, ...] = ()
    car: Ability = Ability()
    heard_s_ago: float = 0.0
    """A step computed ahead of its instant hears advice of an earlier one."""


class World:
    """One scenario with one seed, and one kind of driver."""

    def __init__(self, scenario: Scenario, seed: int, driver: DriverKind = "drawn") -> None:
        self.scenario, self.seed, self.route = scenario, seed, Route(scenario)
        self.static = build_static(self.route, seed)
        self.road = build_road(self.route.section, seed % 2**31)
        ego = scenario.ego
        self.ego = Ego(self.road, lane_index("forward", ego.lane), ego.at_m, ego.speed_kmh / 3.6)
        self.road.vehicles.append(self.ego)
        self.traffic = Traffic(self.route, self.road, self.ego, seed)
        self.traffic.fill(scenario)
        self.law, self.course, self.ledger = build_law(scenario), WeatherCourse(scenario.weather, seed), Ledger()
        self.lines = build_lines(self.route)
        self.lights = Lights([Cycle(plan) for plan in scenario.lights])
        self.cross = CrossTraffic(self.route)
        self.cross.place(self.lines, seed)
        self.road_ahead = RoadAhead(self.ego, self.traffic, self.lines, self.lights, self.cross)
        self._hazard_sources = HazardSources(self.route, self.static, self.law, self.road_ahead)
        self.people = populate(scenario, self.route.kerb_m, self.route.near, seed)
        self._parked = [
            (self.route.section.spine.project(a.pose.x_m, a.pose.y_m)[0], a) for a in build_parked(self.route, seed)
        ]
        self.houses = houses(self.static)
        self.gantries = {i: at_start(plan) for i, plan in enumerate(scenario.gantries)}
        self._passed_panels: dict[int, str] = {}
        self.driver = new_driver(driver, seed, self._legal().limit_mps(False), scenario.ego.absent_mps2)
        self.brake, self._hazards, self._step = Brake(), HazardLog(), 0
        self._braked = Braked(0.0)
        self._wish, self._wheel_rad = pedals(0.0), 0.0
        self._front_before = self._read_to_m = self.road_ahead.front_m
        self._wrecked_s = 0.0

    # One step ---------------------------------------------------------------------------------------------------------

    @property
    def time_s(self) -> float:
        """Seconds since the start."""
        return round(self._step * STEP_S, 6)

    def step(self, inputs: Inputs = Inputs()) -> Snapshot:
        """The world ``STEP_S`` later."""
        self._step += 1
        weather = self._weather()
        self._advance_surroundings()
        self._steer_traffic(weather)
        heading, speed = float(self.ego.heading), float(self.ego.speed)
        self._drive_ego(inputs, weather)
        self.road.act()
        self.road.step(STEP_S)
        self.cross.step(STEP_S, self.ego, self.traffic.cars)
        if self._step % RECYCLE_EVERY == 0:
            self.traffic.recycle()
        motion = self._motion(heading, speed)
        return self._snapshot(motion, weather)

    def _weather(self) -> Weather:
        """The weather where the ego is: water may stand there."""
        weather = self.course.at(self.time_s)
        front = self.road_ahead.front_m
        deep = [water.film_mm for water in self.scenario.water if water.from_m <= front <= water.to_m + self.ego.LENGTH]
        film_mm = max([weather.film_mm, *deep])
        return replace(weather, cover=replace(weather.cover, film_mm=film_mm)) if deep else weather

    def _advance_surroundings(self) -> None:
        self.lights.advance(self.time_s, self.lines, self.road_ahead.front_m)
        around = Surroundings(time_s=self.time_s, ego_s_m=self.road_ahead.front_m, cars_have_red=self._cars_have_red)
        self.people = tuple(step_person(person, around, self.route.kerb_m, STEP_S) for person in self.people)
        self.road_ahead.crossing = tuple(person for person in self.people if person.crossing)
        self.road_ahead.time_s = self.time_s
        if self._step % LAW_EVERY == 0:
            for ordinal, plan in enumerate(self.scenario.gantries):
                downstream = [car.speed for car in self._forward_cars() if 0.0 < car.s_m - plan.at_m < LOOKS_AHEAD_M]
                ego = Comes(plan.at_m - self._read_to_m, float(self.ego.speed))
                self.gantries[ordinal] = decide(plan, self.gantries[ordinal], self.time_s, downstream, ego)

    def _cars_have_red(self, s_m: float) -> bool:
        near = [line for line in self.lines if line.kind == "light" and abs(line.at_m - s_m) < 40.0]
        return any(self.lights.state(line) == "red" for line in near)

    # Traffic ------------------------------------------------------------------------------------------------------------

    def _forward_cars(self) -> list[Car]:
        return [car for car in self.traffic.cars if direction_of(car.lane_index) == "forward"]

    def _steer_traffic(self, weather: Weather) -> None:
        now_showing = {ordinal: shown.code for ordinal, shown in self.gantries.items()}
        for index, car in enumerate(self.traffic.cars):
            car.mu = weather.mu_at(float(car.speed))
            if (self._step + index) % LAW_EVERY == 0 or self._step == 1:
                law = self.law.at(car.s_m, now_showing).limit_mps(weather.wet)
                self.traffic.wish_speed(car, law, self.time_s)
            car.stop_mps2 = min(self.road_ahead.stop_mps2(car), self.traffic.halt_mps2(car, STEP_S))

    # The ego --------------------------------------------------------------------------------------------------------------

    def _legal(self) -> Legal:
        return self.law.at(self.ego.s_m, self._passed_panels)

    def _drive_ego(self, inputs: Inputs, weather: Weather) -> None:
        for advice in inputs.advice:
            self.driver.hear(advice, self.time_s - inputs.heard_s_ago)
        for command in inputs.brakes:
            self.brake = self.brake.receive(command, self._now_ns())
        speed = float(self.ego.speed)
        self.ego.mu = weather.mu_at(speed) * tyres.grip_share(inputs.car.lacking, weather.film_mm, speed)
        self.ego.pull_rad = tyres.pull_rad(inputs.car.lacking)
        before, wish = self._wish, self.driver.drive(self._view(weather, inputs.car), STEP_S)
        controls = Controls(
            accelerator=wish.accelerator,
            accelerator_rate_per_s=(wish.accelerator - before.accelerator) / STEP_S,
            brake=wish.brake,
        )
        self.brake = self.brake.step(self._now_ns(), STEP_S, controls, speed)
        self._wish = wish
        applied = self.brake.applied_mps2
        wanted = min(wish.acceleration_mps2, -asked_for(applied, inputs.car) if applied > 0 else FREE)
        locked = self._braked.locked
        self._braked = decelerate(max(0.0, -wanted), inputs.car, self.ego.mu, weather.film_mm, speed, locked)
        self.ego.command_mps2 = wanted if wanted >= 0.0 else -self._braked.mps2

    def _now_ns(self) -> int:
        return round(self.time_s * 1e9)

    def _view(self, weather: Weather, car: Ability) -> DriverView:
        lead = self.road_ahead.lead()
        line = self.ego.lane.line
        speed = float(self.ego.speed)
        sees_m = self._sees_m(weather, car)
        seen = lead is not None and lead[0] < min(SEES_LEAD_M, sees_m)
        return DriverView(
            time_s=self.time_s,
            speed_mps=speed,
            mu=weather.mu_at(speed),
            wet=weather.wet,
            bend_mps=bend_speed_mps(line.curvature_ahead(self.ego.s_m, 10.0 + 2.2 * speed)),
            sense_mps=SENSE_MPS[self.route.stretch_at(self.ego.s_m).road_class],
            gap_m=lead[0] if lead is not None and seen else None,
            lead_mps=lead[1] if lead is not None else 0.0,
            stop=self.road_ahead.stop_ahead(sees_m),
            person_m=self.road_ahead.person_m(),
            passed=self._posts_passed(weather),
            car_brakes=self.brake.applied_mps2 > 0.0,
        )

    def _sees_m(self, weather: Weather, car: Ability) -> float:
        """How far the driver sees: less through a wet windscreen, at night no further than something lights it."""
        sees_m = weather.visibility_m * (car.sight if weather.rain_mm_h > WIPERS_NEEDED_MM_H else 1.0)
        return min(sees_m, UNLIT_M) if self._night and not car.headlamps else sees_m

    def _posts_passed(self, weather: Weather) -> tuple[tuple[int, float | None, bool], ...]:
        passed, front_m = [], self.road_ahead.front_m
        for number, post in enumerate(self.law.posts):
            if self._read_to_m < post.at_m <= front_m:
                if post.ordinal >= 0:
                    self._passed_panels[post.ordinal] = self.gantries[post.ordinal].code
                limit = self.law.at(post.at_m, self._passed_panels).limit_mps(weather.wet)
                passed.append((number, limit, understands(self.scenario, post)))
        self._read_to_m = front_m
        return tuple(passed)

    # What came of it --------------------------------------------------------------------------------------------------------

    def _motion(self, heading: float, speed: float) -> EgoMotion:
        ego = self.ego
        turned = -(float(ego.heading) - heading)
        yaw_rate = math.remainder(turned, 2 * math.pi) / STEP_S
        if ego.speed > 1.0:
            self._wheel_rad = math.atan(2.7 * yaw_rate / float(ego.speed)) - ego.pull_rad
        pose = to_pose(ego.position, ego.heading)
        s, d = self.route.section.spine.project(pose.x_m, pose.y_m)
        return EgoMotion(
            pose=pose,
            s_m=s,
            d_m=d,
            lane=int(ego.lane_index[2]),
            speed_mps=max(float(ego.speed), 0.0),
            acceleration_mps2=(float(ego.speed) - speed) / STEP_S,
            yaw_rate_radps=yaw_rate,
            road_wheel_rad=self._wheel_rad,
            mu=ego.mu,
            abs_active=ego.speed > 1.5 and self._braked.at_limit and not self._braked.locked,
            locked=ego.speed > 0.0 and self._braked.locked,
            length_m=ego.LENGTH,
            width_m=ego.WIDTH,
        )

    def _snapshot(self, motion: EgoMotion, weather: Weather) -> Snapshot:
        lead = self.road_ahead.lead()
        legal, scene = self._legal(), self._scene(motion.pose, motion.s_m, weather)
        fact = self.ledger.keep(
            time_s=self.time_s,
            dt=STEP_S,
            speed_mps=motion.speed_mps,
            limit_mps=legal.limit_mps(weather.wet),
            country=legal.country,
            lead=None if lead is None else (lead[0], motion.speed_mps - lead[1]),
            hazards=self._sight(scene, weather),
            stop=self._stop_due(),
            crossed=self._crossed(),
            collision=self._wrecked(motion) or self._hits_somebody(motion),
        )
        self._front_before = self.road_ahead.front_m
        self._wrecked_s += STEP_S if self._wrecked_s > 0.0 or self._wrecked(motion) else 0.0
        return Snapshot(
            step=self._step,
            time_s=self.time_s,
            ego=motion,
            scene=scene,
            movers=self._movers(),
            weather=weather,
            wish=self._wish,
            brake=self.brake,
            fact=fact,
            ended=motion.s_m > self.route.length_m - END_BEFORE_M or self._wrecked_s >= WRECKED_S,
        )

    def _sight(self, scene: Scene, weather: Weather) -> tuple[Hazard, ...]:
        """The hazards that are on. Also marks a car from a side road as seen: until then no driver can react to it."""
        sight = Sight(self.houses, scene, weather.visibility_m, self._night)
        for car in self.cross.cars:
            near = car.started and not car.seen and abs(car.s_m - self.ego.s_m) < SEES_CROSS_M
            car.seen = car.seen or (near and sight.reaches(car.number, Box.of(self.cross.actor(car, True)), True))
        return self._hazards.note(self._hazard_sources.now(weather.film_mm), sight.shows, self.time_s)

    def _stop_due(self) -> tuple[LineKind, float] | None:
        due = self.road_ahead.stop_due()
        return None if due is None else (due[0].kind, due[1])

    def _crossed(self) -> Crossed | None:
        front_m = self.road_ahead.front_m
        for line in self.lines:
            if self._front_before < line.at_m + 0.3 <= front_m:
                if line.kind == "light":
                    return Crossed(kind="light", must_have_stopped=self.lights.state(line) == "red")
                return Crossed(kind=line.kind, must_have_stopped=self.road_ahead.must_stop(line, 0.0))
        return None

    def _wrecked(self, motion: EgoMotion) -> bool:
        """Whether the ego touches a vehicle: one of the traffic, where it stands for good, or one out of a side road, where each would
        wait for the other for good."""
        return bool(self.ego.crashed) or any(self._hits(motion, car) for car in self.cross.on_the_road())

    def _hits_somebody(self, motion: EgoMotion) -> bool:
        for person in self.people:
            ahead, beside = person.s_m - motion.s_m, person.d_m - motion.d_m
            if abs(ahead) < motion.length_m / 2 + 0.2 and abs(beside) < motion.width_m / 2 + 0.2:
                return True
        return False

    def _hits(self, motion: EgoMotion, car: CrossCar) -> bool:
        along = abs(car.s_m - motion.s_m) < (motion.length_m + car.body.width_m) / 2
        return along and abs(car.d_m - motion.d_m) < (motion.width_m + car.body.length_m) / 2

    def scene(self) -> Scene:
        """How it looks now."""
        pose = to_pose(self.ego.position, self.ego.heading)
        return self._scene(pose, self.ego.s_m, self.course.at(self.time_s))

    def _scene(self, pose: Pose, s_m: float, weather: Weather) -> Scene:
        lamps = weather.rain_mm_h > 1.0 or weather.visibility_m < LIGHTS_BELOW_M or self._night
        cars = [camera_scene.car_actor(car, lamps) for car in self.traffic.cars if -60.0 < car.s_m - s_m < 450.0]
        crossing = [self.cross.actor(car, lamps) for car in self.cross.on_the_road() if -40.0 < car.s_m - s_m < 200.0]
        people = [camera_scene.person_actor(self.route, person) for person in self._people_near(s_m)]
        return Scene(
            static=self.static,
            ego=pose,
            actors=(*cars, *crossing, *people, *camera_scene.near_parked(self._parked, s_m)),
            panels=camera_scene.panels(self.route, self.gantries),
            lights=camera_scene.heads(self.lines, self.lights),
            atmosphere=atmosphere(weather, self.scenario.daylight),
            time_s=self.time_s,
        )

    def _people_near(self, s_m: float) -> list[Person]:
        """The people near enough for any sensor to perceive."""
        return [person for person in self.people if -40.0 < person.s_m - s_m < 160.0]

    @property
    def _night(self) -> bool:
        return self.scenario.daylight.sun_elevation_deg < 4.0

    def _movers(self) -> tuple[Mover, ...]:
        cars, ego_s_m = [], self.ego.s_m
        for car in self.traffic.cars:
            yaw = -float(car.heading)
            vx, vy = float(car.speed) * math.cos(yaw), float(car.speed) * math.sin(yaw)
            ahead = car.s_m - ego_s_m > 0.0
            cars.append(
                Mover(actor_id=car.number, vx_mps=vx, vy_mps=vy, in_ego_path=ahead and self.road_ahead.in_path(car))
            )
        lane_d = self.road_ahead.lane_d_m
        for each in self.cross.on_the_road():
            yaw = self.cross.pose(each).yaw_rad
            vx, vy = each.speed_mps * math.cos(yaw) * each.started, each.speed_mps * math.sin(yaw) * each.started
            inside = each.s_m > ego_s_m and self.road_ahead.crosses_path(each)
            cars.append(Mover(actor_id=each.number, vx_mps=vx, vy_mps=vy, in_ego_path=inside))
        for person in self._people_near(ego_s_m):
            yaw = self.route.section.spine.yaw(person.s_m)
            c, s = math.cos(yaw), math.sin(yaw)
            along = person.along_mps if person.mode == "walking" else 0.0
            vx, vy = along * c - person.across_mps * s, along * s + person.across_mps * c
            inside = abs(person.d_m - lane_d) < 1.5 and person.s_m > ego_s_m
            cars.append(Mover(actor_id=PERSON_IDS + person.number, vx_mps=vx, vy_mps=vy, in_ego_path=inside))
        return tuple(cars)


def build_static(route: Route, seed: int) -> StaticWorld:
    """What never moves."""
    return StaticWorld(
        road=build_flat(route),
        signs=build_signs(route, seed),
        gantries=build_gantries(route),
        lights=build_lights(route),
        scenery=build_scenery(route, seed),
        seed=seed,
    )
