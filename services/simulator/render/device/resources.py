"""Graphics resources that outlive a scenario: context, programs, textures, actor models, plant variants."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from services.simulator.render import shaders
from services.simulator.render.device.context import open_context
from services.simulator.render.device.face_atlas import FaceAtlas
from services.simulator.render.models import buildings, plants, textures
from services.simulator.render.models.actors import Model, build_model, model_key
from services.simulator.render.models.mesh import VERTEX_FORMAT, VERTEX_NAMES, Builder, Mesh
from services.simulator.scene.scene import Actor
from services.simulator.scene.solids import LAMP_HEIGHT_M

MODEL_CACHE = 160
Uniform = float | int | tuple[float, ...] | bytes

PROGRAMS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "object": ("object", "object", ()),
    "plant": ("leaf", "leaf", ()),
    "furniture": ("object", "object", ("INSTANCED",)),
    "id_object": ("object", "id", ()),
    "id_plant": ("leaf", "id", ("LEAFY",)),
    "id_furniture": ("object", "id", ("INSTANCED",)),
    "ground": ("ground", "ground", ()),
    "line": ("ground", "ground", ("LINE",)),
    "sky": ("sky", "sky", ()),
    "face": ("face", "face", ()),
    "id_face": ("face", "face_id", ("ID",)),
    "glow": ("glow", "glow", ()),
    "shade": ("shade", "shade", ()),
    "blob": ("blob", "blob", ()),
    "post": ("post", "post", ()),
}
"""Vertex stage, fragment stage and defines by program."""
SAMPLERS = {"u_surfaces": 0, "u_faces": 1, "u_image": 2, "u_grain": 3, "u_streaks": 4, "u_drops": 5}
FACE_DTYPE = np.dtype(
    [("centre", "<f4", 3), ("right", "<f4", 3), ("up", "<f4", 3), ("box", "<f4", 4), ("glow", "<f4", 3), ("id", "<f4")]
)
TREES, CONIFERS, HEDGES = 8, 5, 3  # variants; the last of each is for held-out scenes


TRAITS: dict[str, tuple[str, ...]] = {
    "object": ("NIGHT",),
    "plant": ("NIGHT",),
    "furniture": ("NIGHT",),
    "ground": ("NIGHT", "WET"),
    "line": ("NIGHT", "WET"),
    "face": ("NIGHT",),
    "post": ("RAIN",),
}  # which traits of a scene make a program another one


class Drawable:
    """Buffers with one vertex array per program that draws them, made when first needed."""

    def __init__(
        self,
        resources: Resources,
        content: list[tuple[object, ...]],
        indices: moderngl.Buffer | None = None,
        instances: moderngl.Buffer | None = None,
        model: Model | None = None,
    ) -> None:
        self._resources, self._content, self._indices = resources, content, indices
        self._vaos: dict[str, moderngl.VertexArray] = {}
        self.instances, self.model = instances, model

    def vao(self, name: str) -> moderngl.VertexArray:
        """The vertex array for a program in the present traits."""
        key = self._resources.key(name)
        if key not in self._vaos:
            program = self._resources.program(key)
            self._vaos[key] = self._resources.ctx.vertex_array(program, self._content, self._indices, skip_errors=True)
        return self._vaos[key]

    def release(self) -> None:
        """Free the device memory; corner buffers that others share stay."""
        for vao in self._vaos.values():
            vao.release()
        own = {entry[0] for entry in self._content if entry[0] is not self._resources.corners}
        for buffer in own | {self._indices}:
            if isinstance(buffer, moderngl.Buffer):
                buffer.release()


class Resources:
    """Everything that is made once per process; several renderers may share one (on one thread)."""

    def __init__(self) -> None:
        self.ctx = open_context()
        self._programs: dict[str, moderngl.Program] = {}
        self._members: dict[str, dict[str, moderngl.Uniform]] = {}
        self._keys: dict[str, str] = {}
        self.use(frozenset())
        self.corners = self.ctx.buffer(np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)], dtype="<f4").tobytes())
        self.surfaces = self._surfaces()
        self.faces = FaceAtlas(self.ctx)
        self.grain = self._overlay(grain())
        self.streaks = self._overlay(streaks())
        self._models: dict[tuple[object, ...], Drawable] = {}
        self.plants = self._plants()
        self.furniture = self._furniture()
        self.face_buffer = self.ctx.buffer(reserve=1024 * FACE_DTYPE.itemsize, dynamic=True)
        names = ("in_centre", "in_right", "in_up", "in_box", "in_glow", "in_id")
        self.face_sprites = self._sprite(self.face_buffer, "3f 3f 3f 4f 3f 1f/i", names)
        self.glow_buffer = self.ctx.buffer(reserve=4096 * 36, dynamic=True)
        self.glow_sprites = self._sprite(self.glow_buffer, "3f 3f 3f/i", ("in_centre", "in_size", "in_colour"))
        self.blob_buffer = self.ctx.buffer(reserve=2048 * 32, dynamic=True)
        self.blob_sprites = self._sprite(self.blob_buffer, "4f 4f/i", ("in_place", "in_size"))
        self.screen = Drawable(self, [(self.corners, "2f", "in_corner")])

    def use(self, traits: frozenset[str]) -> None:
        """Choose the programs for a scene's traits (``NIGHT``, ``WET``, ``RAIN``)."""
        self._keys = {
            name: "|".join((name, *(trait for trait in TRAITS.get(name, ()) if trait in traits))) for name in PROGRAMS
        }

    def key(self, name: str) -> str:
        """A program's name with the present traits that matter to it."""
        return self._keys[name]

    def program(self, key: str) -> moderngl.Program:
        """The compiled program of a key."""
        if key not in self._programs:
            name, *traits = key.split("|")
            vertex, fragment, defines = PROGRAMS[name]
            program = self.ctx.program(
                vertex_shader=shaders.program(f"{vertex}.vert", *defines, *traits),
                fragment_shader=shaders.program(f"{fragment}.frag", *defines, *traits),
            )
            members = {member: program[member] for member in program}
            self._members[key] = {k: m for k, m in members.items() if isinstance(m, moderngl.Uniform)}
            for sampler, unit in SAMPLERS.items():
                if sampler in self._members[key]:
                    self._members[key][sampler].value = unit
            self._programs[key] = program
        return self._programs[key]

    def _surfaces(self) -> moderngl.TextureArray:
        stack = textures.all_layers()
        array = self.ctx.texture_array((textures.SIZE, textures.SIZE, len(stack)), 4, stack.tobytes())
        array.build_mipmaps(0, 6)
        array.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)
        array.anisotropy = 1.0
        return array

    def _overlay(self, picture: NDArray[np.uint8]) -> moderngl.Texture:
        four = np.zeros((*picture.shape[:2], 4), dtype=np.uint8)  # aligned pixels are faster to fetch
        four[:, :, : picture.shape[2]] = picture
        texture = self.ctx.texture((picture.shape[1], picture.shape[0]), 4, four.tobytes())
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        return texture

    def drops(self, seed: int) -> moderngl.Texture:
        """A texture of drops on the lens."""
        return self._overlay(drops(seed))

    def upload(self, mesh: Mesh, instanced: bool = False, model: Model | None = None) -> Drawable:
        """A mesh on the device."""
        vertices = self.ctx.buffer(mesh.vertices.tobytes())
        content: list[tuple[object, ...]] = [(vertices, VERTEX_FORMAT, *VERTEX_NAMES)]
        instances = self.ctx.buffer(reserve=32 * 1024, dynamic=True) if instanced else None
        if instances is not None:
            content.append((instances, "4f 4f/i", "in_place", "in_look"))
        return Drawable(self, content, self.ctx.buffer(mesh.indices.tobytes()), instances, model)

    def model(self, actor: Actor) -> Drawable:
        """The drawable of an actor's mesh, built on first sight; the least recently used is dropped when full."""
        key = model_key(actor)
        found = self._models.pop(key, None)
        if found is None:
            model = build_model(actor)
            found = self.upload(model.mesh, model=model)
            if len(self._models) >= MODEL_CACHE:
                self._models.pop(next(iter(self._models))).release()
        self._models[key] = found
        return found

    def _plants(self) -> dict[str, list[tuple[Drawable, Drawable]]]:
        makers = {"tree": (plants.tree, TREES), "conifer": (plants.conifer, CONIFERS), "hedge": (plants.hedge, HEDGES)}
        return {
            kind: [
                (
                    self.upload(make(seed).build(), instanced=True),
                    self.upload(make(seed, plants.COARSE).build(), instanced=True),
                )
                for seed in range(count)
            ]
            for kind, (make, count) in makers.items()
        }

    def _furniture(self) -> dict[str, Drawable]:
        lamp, post = Builder(), Builder()
        buildings.lamp(lamp, LAMP_HEIGHT_M, 0.2 * LAMP_HEIGHT_M)
        buildings.marker_post(post, 1.0)
        return {"lamp": self.upload(lamp.build(), instanced=True), "post": self.upload(post.build(), instanced=True)}

    def _sprite(self, buffer: moderngl.Buffer, layout: str, names: tuple[str, ...]) -> Drawable:
        return Drawable(self, [(self.corners, "2f", "in_corner"), (buffer, layout, *names)])

    def set(self, name: str, values: Mapping[str, Uniform]) -> None:
        """Set those uniforms that the program has, in its present traits."""
        key = self._keys[name]
        self.program(key)
        members = self._members[key]
        for uniform, value in values.items():
            member = members.get(uniform)
            if member is None:
                continue
            if isinstance(value, bytes):
                member.write(value)
            else:
                member.value = value

    def close(self) -> None:
        """Free the context and all in it."""
        self.ctx.release()


GRAIN = 256
STREAKS = 512
DROPS = (256, 144)
Bytes = NDArray[np.uint8]


def grain() -> Bytes:
    """Gaussian noise (GRAIN, GRAIN, 3) around 127.5, deviation one quarter of the range."""
    rng = np.random.default_rng(51)
    return (127.5 + 64 * rng.normal(size=(GRAIN, GRAIN, 3))).clip(0, 255).astype(np.uint8)


def streaks() -> Bytes:
    """Falling drops (STREAKS, STREAKS, 2): near ones long and few, far ones fine and many."""
    rng = np.random.default_rng(52)
    out = np.zeros((STREAKS, STREAKS, 2), dtype=np.float32)
    for channel, (count, length, width) in enumerate(((130, (30, 90), 2), (420, (14, 40), 1))):
        layer = np.zeros((STREAKS, STREAKS), dtype=np.float32)
        for _ in range(count):
            x, y = int(rng.integers(0, STREAKS)), int(rng.integers(0, STREAKS))
            size = int(rng.integers(*length))
            for shift in (0, -STREAKS):  # wraps around, so that the picture tiles
                end = (x + size // 16, y + size + shift)
                cv2.line(layer, (x, y + shift), end, float(rng.uniform(0.25, 1.0)), width, cv2.LINE_AA)
        out[:, :, channel] = cv2.blur(layer, (2, 7))
    return (out * 255).clip(0, 255).astype(np.uint8)


def drops(seed: int) -> Bytes:
    """Refraction offsets and brightness (H, W, 3) of drops on the lens; 127 is no offset."""
    rng = np.random.default_rng((53, seed))
    wide, high = DROPS
    out = np.zeros((high, wide, 3), dtype=np.float32)
    rows, columns = np.mgrid[0:high, 0:wide].astype(np.float32)
    for _ in range(int(rng.integers(16, 34))):
        radius = float(rng.uniform(1.5, 6.5))
        x, y = float(rng.uniform(0, wide)), float(rng.uniform(0, high))
        dx, dy = (columns - x) / radius, (rows - y) / (radius * float(rng.uniform(1.0, 1.4)))
        r2 = dx * dx + dy * dy
        inside = r2 < 1
        bend = np.sqrt(np.maximum(1 - r2, 0))
        out[:, :, 0][inside] = (-dx * (1 - bend))[inside]
        out[:, :, 1][inside] = (-dy * (1 - bend))[inside]
        out[:, :, 2][inside] = (0.8 - r2)[inside] * np.sign(dy - 0.2)[inside]
    soft = np.asarray(cv2.GaussianBlur(out, (3, 3), 0), dtype=np.float32)
    soft[:, :, :2] = 127.0 + 127.0 * soft[:, :, :2]
    soft[:, :, 2] = np.maximum(soft[:, :, 2], 0) * 255
    return soft.clip(0, 255).astype(np.uint8)
