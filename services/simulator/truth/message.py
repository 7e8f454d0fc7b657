"""The truth of a moment as it is published for evaluation."""

import dataclasses
import math

from proto.truth import TrueActor, TrueHazard, Truth
from services.simulator.road.stop_lines import Lights, Line, LineKind
from services.simulator.scene.scene import Actor, Box, StaticWorld, in_ego_frame
from services.simulator.truth.line_of_sight import Boxes, share_in_sight
from services.simulator.truth.snapshot import Snapshot

SIGNS_WITHIN_M, ACTORS_WITHIN_M, LIGHT_WITHIN_M, WALLED_WITHIN_M = 150.0, 160.0, 120.0, 90.0


_STOPS: dict[LineKind, str] = {"light": "red_light", "stop_line": "stop_sign", "yield": "yield"}


def truth_of(
    snapshot: Snapshot,
    static: StaticWorld,
    houses: Boxes,
    lines: tuple[Line, ...],
    lights: Lights,
    *,
    distracted: bool,
    faults: tuple[str, ...],
    brake_share: float,
    driver_language: str,
) -> Truth:
    """The truth of a snapshot. `faults` are the presets that are on, `brake_share` what the car brakes of what the road gives."""
    fact, ego = snapshot.fact, snapshot.ego
    oldest = fact.hazards[0] if fact.hazards else None
    line = next((each for each in lines if each.kind == "light" and 0.0 < each.at_m - ego.s_m < LIGHT_WITHIN_M), None)
    return Truth(
        time_s=snapshot.time_s,
        distance_m=fact.distance_m,
        speed_mps=ego.speed_mps,
        acceleration_mps2=ego.acceleration_mps2,
        law_limit_mps=fact.limit_mps,
        jurisdiction=fact.country,
        mu=ego.mu,
        gap_m=fact.gap_m,
        closing_mps=fact.closing_mps,
        actors=_actors(snapshot, houses),
        light=lights.state(line) if line is not None else None,
        light_distance_m=line.at_m - ego.s_m - ego.length_m / 2 if line is not None else None,
        signs=_signs(snapshot, static),
        hazard=oldest.kind if oldest is not None else "",
        hazard_onset_s=oldest.onset_s if oldest is not None else None,
        infraction=fact.infraction,
        collision=fact.collision,
        driver={
            "accelerator": snapshot.wish.accelerator,
            "brake": snapshot.wish.brake,
            "system_brake_mps2": snapshot.brake.applied_mps2,
            "distracted": float(distracted),
            "infractions": float(fact.infractions),
            "speeding_s": fact.speeding_s,
        },
        film_mm=snapshot.weather.film_mm,
        visibility_m=snapshot.weather.visibility_m,
        rain_mm_h=snapshot.weather.rain_mm_h,
        dark=snapshot.scene.atmosphere.night,
        hazards=tuple(TrueHazard(**dataclasses.asdict(each)) for each in fact.hazards),
        stop_kind=_STOPS[fact.stop[0]] if fact.stop is not None else "",
        stop_distance_m=fact.stop[1] if fact.stop is not None else None,
        faults=faults,
        brake_share=brake_share,
        heading_rad=snapshot.ego.pose.yaw_rad,
        driver_language=driver_language,
    )


def _actors(snapshot: Snapshot, houses: Boxes) -> tuple[TrueActor, ...]:
    ego, movers = snapshot.ego, {mover.actor_id: mover for mover in snapshot.movers}
    c, s = math.cos(ego.pose.yaw_rad), math.sin(ego.pose.yaw_rad)
    evx, evy = ego.speed_mps * c, ego.speed_mps * s
    actors = []
    for actor in snapshot.scene.actors:
        x, y = in_ego_frame(ego.pose, actor.pose.x_m, actor.pose.y_m)
        if math.hypot(x, y) > ACTORS_WITHIN_M:
            continue
        mover = movers.get(actor.id)
        vx, vy = ((mover.vx_mps if mover else 0.0) - evx, (mover.vy_mps if mover else 0.0) - evy)
        actors.append(
            TrueActor(
                actor_id=actor.id,
                kind="pedestrian" if actor.kind == "pedestrian" else "vehicle",
                x_m=x,
                y_m=y,
                vx_mps=vx * c + vy * s,
                vy_mps=vy * c - vx * s,
                length_m=actor.length_m,
                width_m=actor.width_m,
                in_ego_path=mover.in_ego_path if mover else False,
                walled=_walled(snapshot, actor, houses) if 0.0 < x < WALLED_WITHIN_M else 0.0,
            )
        )
    return tuple(actors)


def _walled(snapshot: Snapshot, actor: Actor, houses: Boxes) -> float:
    return 1.0 - share_in_sight(snapshot.ego.pose, Box.of(actor), houses)


def _signs(snapshot: Snapshot, static: StaticWorld) -> tuple[dict[str, str | float], ...]:
    """Faces ahead, topmost first per post, and gantry panels as they show now."""
    found: list[dict[str, str | float]] = []
    for post in static.signs:
        x, y = in_ego_frame(snapshot.ego.pose, post.pose.x_m, post.pose.y_m)
        if -5.0 < x < SIGNS_WITHIN_M and abs(y) < 40.0:
            codes = "+".join(face.code for face in post.faces)
            found.append({"id": float(post.id), "code": codes, "country": post.faces[0].country, "x_m": x, "y_m": y})
    for gantry in static.gantries:
        x, y = in_ego_frame(snapshot.ego.pose, gantry.pose.x_m, gantry.pose.y_m)
        for panel in gantry.panels:
            code = snapshot.scene.panels.get(panel.id, panel.code)
            if -5.0 < x < SIGNS_WITHIN_M and code:
                beside = y + panel.lateral_m
                found.append({"id": float(panel.id), "code": code, "country": panel.country, "x_m": x, "y_m": beside})
    return tuple(found)
