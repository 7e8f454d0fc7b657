"""The renderer's face to the rest: a scene and a camera in, a picture out."""

from __future__ import annotations

import zlib
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from services.simulator.render.device.context import Picture, Targets
from services.simulator.render.device.resources import Resources, Uniform
from services.simulator.render.drawing import frame, glow
from services.simulator.render.drawing.frame import Cast
from services.simulator.render.drawing.light import light_of
from services.simulator.render.drawing.static_world import World
from services.simulator.render.drawing.view import View
from services.simulator.scene.scene import CameraSpec, Scene, StaticWorld

BLEND: Any = (moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ONE, moderngl.ONE)
ADD: Any = (moderngl.ONE, moderngl.ONE)
LEAST: Any = moderngl.MIN  # the library's annotations are narrower than what it takes
SUM: Any = moderngl.FUNC_ADD
SHADE_REACH_M = 90.0
WIPER_PERIOD_S = 1.1  # the drops on the lens gather until the next wipe, then others fall


class Renderer:
    """Draws scenes of one static world; ``load`` changes the world and keeps all that was compiled.

    Not thread-safe: use it on the thread that made it. The same seed, scene and camera give the same picture.
    Raises ``RendererUnavailable`` where there is no OpenGL by EGL.
    """

    def __init__(self, static: StaticWorld, seed: int = 0) -> None:
        self._resources, self._seed = Resources(), seed
        self._world = World(self._resources, static)
        self._targets = Targets(self._resources.ctx)
        self._drops = self._resources.drops(seed)

    def load(self, static: StaticWorld) -> None:
        """Replace the static world."""
        self._world.release()
        self._world = World(self._resources, static)

    def render(self, scene: Scene, camera: CameraSpec) -> NDArray[np.uint8]:
        """The camera's picture, RGB (height_px, width_px, 3)."""
        cast = self._cast(scene, camera)
        picture = self._targets.picture(camera.width_px, camera.height_px)
        self._draw(cast, picture.raw)
        self._develop(cast, picture)
        data = picture.final.read(components=3, alignment=1)
        return np.frombuffer(data, dtype=np.uint8).reshape(camera.height_px, camera.width_px, 3)

    def close(self) -> None:
        """Free the graphics context; the renderer cannot draw afterwards."""
        self._resources.close()

    def _cast(self, scene: Scene, camera: CameraSpec) -> Cast:
        if scene.static is not self._world.static:
            self.load(scene.static)
        light = light_of(scene.atmosphere)
        traits = {"NIGHT": light.night > 0, "WET": light.wet > 0.02, "RAIN": scene.atmosphere.rain_mm_h > 0}
        self._resources.use(frozenset(name for name, holds in traits.items() if holds))
        return frame.cast(self._resources, self._world, scene, View.of(camera, scene.ego), light)

    def _draw(self, cast: Cast, target: moderngl.Framebuffer) -> None:
        resources, world, ctx = self._resources, self._world, self._resources.ctx
        shared = frame.common(cast, world)
        target.use()
        fog = np.sqrt(cast.light.fog)
        target.clear(float(fog[0]), float(fog[1]), float(fog[2]), 1.0, depth=1.0)
        resources.surfaces.use(0)
        resources.faces.texture.use(1)
        ctx.disable(moderngl.CULL_FACE | moderngl.BLEND)
        ctx.enable(moderngl.DEPTH_TEST)
        self._solids(cast, shared)
        ctx.enable(moderngl.BLEND)
        ctx.blend_func = BLEND
        frame.draw_ground(resources, world, cast, shared)
        self._shade(cast, shared)
        ctx.disable(moderngl.BLEND)
        frame.draw_sky(resources, cast, shared)
        ctx.enable(moderngl.BLEND)
        ctx.blend_func = BLEND
        frame.draw_faces(resources, frame.face_rows(resources, cast, 1), "face", shared)
        self._glare(cast, target, shared)

    def _shade(self, cast: Cast, shared: dict[str, Uniform]) -> None:
        """Shadows go to the target's alpha by minimum, so that overlaps do not add up; white leaves the colours."""
        resources, ctx = self._resources, self._resources.ctx
        ctx.blend_equation = LEAST
        count = glow.upload(resources.blob_buffer, glow.blobs(self._world, cast))
        if count:
            resources.set("blob", shared)
            resources.blob_sprites.vao("blob").render(moderngl.TRIANGLE_STRIP, instances=count)
        if cast.light.shadow > 0.05:
            resources.set("shade", shared | {"u_shade": cast.light.shadow})
            for actor in cast.actors:
                away = np.hypot(actor.pose.x_m - cast.view.eye[0], actor.pose.y_m - cast.view.eye[1])
                if actor.kind != "pedestrian" and away < SHADE_REACH_M:
                    frame.draw_actor(resources, actor, cast, "shade")
        ctx.blend_equation = SUM

    def _solids(self, cast: Cast, shared: dict[str, Uniform]) -> None:
        resources, world = self._resources, self._world
        resources.set("object", shared)
        for actor in cast.actors:
            frame.draw_actor(resources, actor, cast, "object")
        for item in cast.lights:
            frame.draw_light(resources, item, "object")
        frame.draw_solid(resources, world, cast, "object", shared)
        frame.draw_plants(resources, world, cast, "", shared)

    def _glare(self, cast: Cast, target: moderngl.Framebuffer, shared: dict[str, Uniform]) -> None:
        resources, spec = self._resources, cast.view.spec
        count = glow.upload(resources.glow_buffer, glow.glows(self._world, cast))
        if not count:
            return
        resources.ctx.blend_func = ADD
        target.depth_mask = False
        target.use()
        aspect = (2 * spec.focal_px / spec.width_px, 2 * spec.focal_px / spec.height_px)
        resources.set("glow", shared | {"u_aspect": aspect})
        resources.glow_sprites.vao("glow").render(moderngl.TRIANGLE_STRIP, instances=count)
        target.depth_mask = True
        target.use()

    def _develop(self, cast: Cast, picture: Picture) -> None:
        """From the drawn frame to the sensor's picture: shadows, blur, rain, drops, vignette, noise."""
        resources, light, scene = self._resources, cast.light, cast.scene
        stamp = zlib.crc32(f"{self._seed}/{cast.view.spec.id}/{scene.time_s:.4f}".encode())
        rng = np.random.default_rng(stamp)
        rain = float(np.clip(scene.atmosphere.rain_mm_h / 14, 0, 1)) ** 0.6
        wipe, dwell = divmod(scene.time_s, WIPER_PERIOD_S)
        spots = np.random.default_rng((self._seed & 0xFFFFFFFF, int(wipe))).uniform(size=2)
        streak = np.sqrt(np.clip(np.array(light.fog) * 1.15 + 0.02, 0, 1))
        picture.final.use()
        resources.ctx.disable(moderngl.DEPTH_TEST | moderngl.BLEND)
        for unit, texture in ((2, picture.colour), (3, resources.grain), (4, resources.streaks), (5, self._drops)):
            texture.use(unit)
        resources.set(
            "post",
            {
                "u_texel": (1 / picture.raw.width, 1 / picture.raw.height),
                "u_shift": (int(rng.integers(256)), int(rng.integers(256))),
                "u_rain": (0.55 * rain, float(rng.uniform()), float(rng.uniform())),
                "u_noise": light.noise,
                "u_drop": min(1.0, rain * 1.2) * (0.15 + 0.85 * dwell / WIPER_PERIOD_S),
                "u_drop_shift": (float(spots[0]), float(spots[1])),
                "u_streak_colour": (float(streak[0]), float(streak[1]), float(streak[2])),
                "u_gain": light.gain,
            },
        )
        resources.screen.vao("post").render(moderngl.TRIANGLE_STRIP)
