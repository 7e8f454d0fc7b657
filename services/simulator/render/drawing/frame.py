"""Drawing one frame: which pieces are seen, in which order they are drawn, with which uniforms."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from services.simulator.render.device.face_atlas import FaceKey
from services.simulator.render.device.resources import FACE_DTYPE, Drawable, Resources, Uniform
from services.simulator.render.drawing.light import HEADLIGHT_GAIN, Light
from services.simulator.render.drawing.static_world import FaceSpot, World, fill_instances
from services.simulator.render.drawing.view import View
from services.simulator.render.models.actors import actor_matrix, lamp_levels
from services.simulator.render.models.mesh import Floats, Material
from services.simulator.scene.scene import Actor, LightState, Scene, TrafficLight

REACH_M = 260.0
SOLID_REACH_M = 400.0
COARSE_FROM_M = 55.0  # plants beyond are drawn coarsely; for a focal length of 457 px, else in proportion
LIT: dict[LightState, tuple[Material, ...]] = {
    "red": (Material.RED,),
    "red_amber": (Material.RED, Material.AMBER),
    "amber": (Material.AMBER,),
    "green": (Material.GREEN,),
    "off": (),
}
IDENTITY = np.eye(4, dtype="<f4").tobytes()


@dataclass(slots=True, eq=False)
class Cast:
    """What of a scene a view may show."""

    scene: Scene
    view: View
    light: Light
    actors: list[Actor]
    models: dict[int, Drawable]
    lights: list[tuple[TrafficLight, Drawable, LightState]]
    faces: list[tuple[FaceSpot, str]]
    solid: np.ndarray


def cast(resources: Resources, world: World, scene: Scene, view: View, light: Light) -> Cast:
    """Cull a scene to what the view may show; actors nearest first."""
    actors = _seen_actors(scene, view)
    return Cast(
        scene,
        view,
        light,
        actors,
        {actor.id: resources.model(actor) for actor in actors},
        [
            (item, drawable, scene.lights.get(item.id, item.state))
            for item, drawable in world.lights
            if view.sees(np.array([[item.pose.x_m, item.pose.y_m, 2.5]]), np.array([6.0]), REACH_M)[0]
        ],
        _seen_faces(world, scene, view),
        view.sees(world.solid.centres, world.solid.radii, SOLID_REACH_M)
        if len(world.solid.counts)
        else np.zeros(0, bool),
    )


def _seen_actors(scene: Scene, view: View) -> list[Actor]:
    if not scene.actors:
        return []
    centres = np.array([(a.pose.x_m, a.pose.y_m, a.pose.z_m + a.height_m / 2) for a in scene.actors])
    radii = np.array([np.hypot(np.hypot(a.length_m, a.width_m), a.height_m) / 2 + 0.3 for a in scene.actors])
    seen = view.sees(centres, radii, REACH_M)
    gaps = np.linalg.norm(centres - view.eye, axis=1)
    return [scene.actors[k] for k in np.argsort(gaps) if seen[k]]


def _seen_faces(world: World, scene: Scene, view: View) -> list[tuple[FaceSpot, str]]:
    if not world.faces:
        return []
    centres = np.array([spot.centre for spot in world.faces])
    sizes = np.array([max(spot.width_m, spot.height_m) for spot in world.faces])
    gaps = np.linalg.norm(centres - view.eye, axis=1)
    seen = view.sees(centres, sizes, REACH_M)
    out = []
    for k in np.argsort(-gaps):  # farthest first: their rims blend
        spot = world.faces[k]
        code = scene.panels.get(spot.owner, spot.code) if spot.led else spot.code
        if seen[k] and code:
            out.append((spot, code))
    return out


def common(cast_: Cast, world: World) -> dict[str, Uniform]:
    """Uniforms that most programs share."""
    view, light, ego = cast_.view, cast_.light, cast_.scene.ego
    ahead = (float(np.cos(ego.yaw_rad)), float(np.sin(ego.yaw_rad)), 0.0)
    lamps, count = _near_lamps(world, view) if light.night > 0 else (np.zeros((6, 4)), 0)
    return {
        "u_clip": np.ascontiguousarray(view.clip_matrix().T, dtype="<f4").tobytes(),
        "u_eye": (float(view.eye[0]), float(view.eye[1]), float(view.eye[2])),
        "u_sun_dir": light.sun_dir,
        "u_sun": light.sun,
        "u_sky": light.sky,
        "u_earth": light.earth,
        "u_fog": light.fog,
        "u_zenith": light.zenith,
        "u_horizon": light.horizon,
        "u_beta": light.beta,
        "u_night": light.night,
        "u_wet": light.wet,
        "u_beam": HEADLIGHT_GAIN * light.night,
        "u_beam_pos": (ego.x_m + 1.9 * ahead[0], ego.y_m + 1.9 * ahead[1], ego.z_m + 0.65),
        "u_beam_dir": ahead,
        "u_street": lamps.astype("<f4").tobytes(),
        "u_streets": count,
        "u_pixel": 1.0 / view.spec.focal_px,
    }


def _near_lamps(world: World, view: View) -> tuple[Floats, int]:
    out = np.zeros((6, 4))
    ahead = view.camera_points(world.street_lamps)[:, 2] if len(world.street_lamps) else np.zeros(0)
    useful = np.nonzero((ahead > -12) & (ahead < 110))[0]
    useful = useful[np.argsort(ahead[useful])][:6]
    out[: len(useful), :3] = world.street_lamps[useful]
    return out, len(useful)


def draw_sky(resources: Resources, cast_: Cast, shared: dict[str, Uniform]) -> None:
    """The gradient with clouds over the whole target."""
    view, light = cast_.view, cast_.light
    half_u = view.spec.width_px / 2 / view.spec.focal_px
    half_v = view.spec.height_px / 2 / view.spec.focal_px
    rays = np.stack([view.axes[0] * half_u, -view.axes[1] * half_v, view.axes[2]], axis=1)
    resources.set("sky", shared)
    resources.set(
        "sky",
        {
            "u_rays": np.ascontiguousarray(rays.T, dtype="<f4").tobytes(),
            "u_haze": light.haze,
            "u_cloud": light.cloud,
            "u_drift": (cast_.scene.static.seed % 97 * 0.137 + cast_.scene.time_s * 2e-4, 0.31),
            "u_ridge": (cast_.scene.static.seed % 89 * 0.0113, cast_.scene.static.seed % 83 * 0.0127),
            "u_low": max(-1.0, min(1.0, view.horizon_ndc() - 0.08)),
        },
    )
    resources.screen.vao("sky").render(moderngl.TRIANGLE_STRIP)


def draw_ground(resources: Resources, world: World, cast_: Cast, shared: dict[str, Uniform]) -> None:
    """Surfaces from the uppermost layer down, each pixel shaded once; then the lines, blended over them."""
    view, pieces = cast_.view, world.ground
    still = {"u_shift": (0.0, 0.0)}
    resources.set("ground", shared | still)
    resources.set("line", shared | still)
    runs = pieces.runs(view.sees(pieces.centres, pieces.radii, 500.0)) if pieces.drawable is not None else []
    for wanted in (False, True):
        for first, count, line in runs if wanted else reversed(runs):
            if line == wanted and pieces.drawable is not None:
                pieces.drawable.vao("line" if line else "ground").render(vertices=count, first=first)
        if not wanted:
            shift = (float(np.round(view.eye[0] / 50) * 50), float(np.round(view.eye[1] / 50) * 50))
            resources.set("ground", {"u_shift": shift})
            world.meadow.vao("ground").render()


def draw_plants(resources: Resources, world: World, cast_: Cast, prefix: str, shared: dict[str, Uniform]) -> None:
    """Plants and furniture by instancing."""
    focal, near_focal = cast_.view.spec.focal_px, 457.0
    levels = np.zeros(16, dtype="<f4")
    levels[Material.STREET] = 2.0 * cast_.light.night
    for program, groves in (("plant", world.plants), ("furniture", world.furniture)):
        resources.set(prefix + program, shared | {"u_lamp": levels.tobytes(), "u_phase": 0.0, "u_id": 0})
        for grove in groves:
            seen = cast_.view.sees(grove.centres, grove.radii, grove.reach_m)
            far = np.linalg.norm(grove.centres - cast_.view.eye, axis=1) * near_focal > COARSE_FROM_M * focal
            for drawable, chosen in ((grove.near, seen & ~far), (grove.far, seen & far)):
                count = fill_instances(drawable, grove.rows[chosen])
                if count:
                    drawable.vao(prefix + program).render(instances=count)


def draw_solid(resources: Resources, world: World, cast_: Cast, name: str, shared: dict[str, Uniform]) -> None:
    """Houses, gantries and posts."""
    if world.solid.drawable is None:
        return
    resources.set(name, shared | {"u_model": IDENTITY, "u_lamp": bytes(64), "u_phase": 0.0, "u_id": 0})
    for first, count, _ in world.solid.runs(cast_.solid):
        world.solid.drawable.vao(name).render(vertices=count, first=first)


def draw_actor(resources: Resources, actor: Actor, cast_: Cast, name: str, instance: int = 0) -> None:
    """One actor with a program whose shared uniforms are set."""
    levels = lamp_levels(actor, cast_.scene.time_s, cast_.light.night > 0).astype("<f4")
    resources.set(
        name,
        {
            "u_model": np.ascontiguousarray(actor_matrix(actor).T, dtype="<f4").tobytes(),
            "u_lamp": levels.tobytes(),
            "u_phase": actor.walk_phase % 1.0,
            "u_id": instance,
        },
    )
    cast_.models[actor.id].vao(name).render()


def draw_light(
    resources: Resources, item: tuple[TrafficLight, Drawable, LightState], name: str, instance: int = 0
) -> None:
    """One traffic light with its lamps lit as its state says."""
    light, drawable, state = item
    levels = np.zeros(16, dtype="<f4")
    for material in (Material.RED, Material.AMBER, Material.GREEN):
        levels[material] = 1.3 if material in LIT[state] else -0.36
    c, s = np.cos(light.pose.yaw_rad), np.sin(light.pose.yaw_rad)
    matrix = np.array([[c, -s, 0, light.pose.x_m], [s, c, 0, light.pose.y_m], [0, 0, 1, light.pose.z_m], [0, 0, 0, 1]])
    model = np.ascontiguousarray(matrix.T, dtype="<f4").tobytes()
    resources.set(name, {"u_model": model, "u_lamp": levels.tobytes(), "u_phase": 0.0, "u_id": instance})
    drawable.vao(name).render()


def face_key(spot: FaceSpot, code: str) -> FaceKey:
    """What decides the picture of a face that shows a code."""
    return FaceKey(spot.country, code, spot.text, spot.font, spot.seed)


def face_rows(resources: Resources, cast_: Cast, first_id: int) -> np.ndarray:
    """The instance table of all visible faces; ids count up from ``first_id``."""
    rows = np.zeros(len(cast_.faces), dtype=FACE_DTYPE)
    for k, (spot, code) in enumerate(cast_.faces):
        c, s = np.cos(spot.yaw_rad), np.sin(spot.yaw_rad)
        rows[k]["centre"] = spot.centre
        rows[k]["right"] = (-s * spot.width_m / 2, c * spot.width_m / 2, 0.0)
        rows[k]["up"] = (0.0, 0.0, spot.height_m / 2)
        rows[k]["box"] = resources.faces.box(face_key(spot, code))
        rows[k]["glow"] = (1.15 if spot.led else 0.0, 0.0 if spot.led else 1.0, 0.0)
        rows[k]["id"] = first_id + k
    return rows


def draw_faces(resources: Resources, rows: np.ndarray, name: str, shared: dict[str, Uniform]) -> None:
    """All sign and panel faces, farthest first."""
    if not len(rows):
        return
    resources.set(name, shared)
    resources.face_buffer.write(rows[:1024].tobytes())
    resources.face_sprites.vao(name).render(moderngl.TRIANGLE_STRIP, instances=min(len(rows), 1024))
