"""A straight avenue of signs, panels and lights in the renderer, to train and measure the reader on rendered pictures.

What "test" holds out: the lettering styles of ``reader_fonts.TEST_STYLES`` and the random stream.
"""

from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np

from evaluation.modelled_sensors.sign_faces import orders
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.classes import LED_VALUES, LIGHTS, PANELS, PLATES, SIGNS
from services.simulator.scene.scene import (
    FRONT,
    TELE,
    Atmosphere,
    CameraSpec,
    Gantry,
    GantryPanel,
    Lane,
    LightState,
    Pose,
    Road,
    Scene,
    Scenery,
    SignFace,
    SignPost,
    StaticWorld,
    Strip,
    TrafficLight,
)
from services.simulator.signart.lettering import STYLES
from training.labelling import Label, LabellingRenderer
from training.sign_pictures.fonts import TEST_STYLES
from training.sign_pictures.texts import text_for
from training.stages.stage import random_stage

Chance = np.random.Generator
SPACING_M = 45.0
_TOWARDS_DRIVER = float(np.pi)
_STATES: tuple[LightState, ...] = ("red", "red_amber", "amber", "green", "off")
_PLATE_CODES = tuple(plate for plate in PLATES if plate != "plate:end")


class Avenue(NamedTuple):
    """The world, and how long it is."""

    static: StaticWorld
    length_m: float


def avenue(count: int, split: str, seed: int, only: tuple[str, ...] = (), signs: tuple[str, ...] = SIGNS) -> Avenue:
    """A road with a sign post every 45 m, and a gantry or a light at every seventh place; ``only``: nothing else."""
    chance = np.random.default_rng([seed, 41, len(split)])
    length = (count + 2) * SPACING_M
    posts, gantries, lights = [], [], []
    for index in range(count):
        x = (index + 2) * SPACING_M
        if not only and index % 7 == 3:
            gantries.append(_gantry(index, x, split, chance))
        elif not only and index % 7 == 5:
            lights.append(_light(index, x, chance))
        else:
            posts.append(_post(index, x, split, chance, only or _chosen(signs, chance)))
    scenery = scenery_along(length, chance)
    static = StaticWorld(
        road=straight_road(length),
        signs=tuple(posts),
        gantries=tuple(gantries),
        lights=tuple(lights),
        scenery=scenery,
        seed=seed,
    )
    return Avenue(static, length)


def straight_road(length_m: float) -> Road:
    """Two lanes between verges, from before the first place to beyond the last."""
    line = np.array([(-60.0, 0.0), (length_m + 200, 0.0)])
    lanes = tuple(Lane(centre_m=line + np.array([0.0, y]), left="dashed", right="edge") for y in (0.0, 3.5))
    ground = tuple(Strip(surface="verge", centre_m=line + np.array([0.0, y]), width_m=9.0) for y in (-6.3, 9.8))
    return Road(lanes=lanes, strips=ground)


def _font(split: str, chance: Chance) -> int:
    fonts = [n for n in range(len(STYLES)) if (n in TEST_STYLES) == (split == "test")]
    return int(fonts[int(chance.integers(len(fonts)))])


def _face(label: str, split: str, chance: Chance, country: str = "") -> SignFace:
    choices = [order for order in orders(label) if order.country == country] or list(orders(label))
    order = choices[int(chance.integers(len(choices)))]
    look = int(chance.integers(0, 1 << 20)) if chance.random() < 0.6 else 0
    text = text_for(order.text, chance)
    return SignFace(country=order.country, code=order.code, text=text, font=_font(split, chance), look_seed=look)


def _chosen(signs: tuple[str, ...], chance: Chance) -> tuple[str, ...]:
    """Any of the signs, or in two of five cases a limit."""
    return signs if chance.random() < 0.6 else tuple(label for label in signs if label.startswith("limit:"))


def _post(index: int, x: float, split: str, chance: Chance, labels: tuple[str, ...]) -> SignPost:
    first = _face(str(chance.choice(labels)), split, chance)
    faces = [first]
    if chance.random() < 0.4:
        faces.append(_face(str(chance.choice(_PLATE_CODES)), split, chance))
    elif chance.random() < 0.15:
        faces.append(_face(str(chance.choice(SIGNS)), split, chance))
    side = -1.0 if chance.random() < 0.75 else 1.0
    y = -float(chance.uniform(2.6, 4.5)) if side < 0 else float(chance.uniform(6.2, 7.5))
    pose = Pose(x_m=x, y_m=y, yaw_rad=_TOWARDS_DRIVER + float(chance.normal(0, 0.12)))
    return SignPost(id=100 + index, pose=pose, faces=tuple(faces), height_m=float(chance.uniform(2.2, 2.9)))


def _gantry(index: int, x: float, split: str, chance: Chance) -> Gantry:
    panels = []
    for number, lateral in enumerate((-1.75 - 1.75, 0.0, 3.5)):
        values = [f"led:{value}" for value in LED_VALUES]
        label = str(chance.choice(values if chance.random() < 0.6 else PANELS))
        order = orders(label)[int(chance.integers(len(orders(label))))]
        code = "" if label == "led:blank" and chance.random() < 0.5 else order.code
        panels.append(
            GantryPanel(
                id=10_000 + 4 * index + number,
                lateral_m=lateral,
                country=order.country,
                code=code,
                font=_font(split, chance),
            )
        )
    pose = Pose(x_m=x, y_m=0.0, yaw_rad=_TOWARDS_DRIVER)
    return Gantry(id=20_000 + index, pose=pose, span_m=14.0, panels=tuple(panels))


def _light(index: int, x: float, chance: Chance) -> TrafficLight:
    state = any_state(chance)
    pose = Pose(x_m=x, y_m=-3.0, yaw_rad=_TOWARDS_DRIVER + float(chance.normal(0, 0.05)))
    arm = float(chance.choice([0.0, 0.0, 2.5]))
    return TrafficLight(id=30_000 + index, pose=pose, state=state, arm_m=arm, height_m=2.7 if not arm else 4.8)


def any_state(chance: Chance) -> LightState:
    """What a light shows."""
    return _STATES[int(chance.integers(len(_STATES)))]


def scenery_along(length: float, chance: Chance) -> tuple[Scenery, ...]:
    """Trees, houses and posts along both sides of the road."""
    kinds = ("tree", "conifer", "house", "tower", "lamp", "post", "hedge")
    things = []
    for x in np.arange(0.0, length + 80, 9.0):
        kind = kinds[int(chance.integers(len(kinds)))]
        far = 14.0 if kind in ("house", "tower") else 7.5
        y = float(chance.choice([-1.0, 1.0])) * float(chance.uniform(far, far + 12)) + 2.0
        pose = Pose(x_m=float(x), y_m=y, yaw_rad=-np.pi / 2 if y > 0 else np.pi / 2)
        things.append(Scenery(kind=kind, pose=pose, look_seed=int(chance.integers(1 << 20))))  # type: ignore[arg-type]
    return tuple(things)


def any_atmosphere(chance: Chance, split: str) -> Atmosphere:
    """The weather of a random stage."""
    return random_stage(int(chance.integers(1 << 30)), "train" if split == "train" else "test")[1].atmosphere


class Frame(NamedTuple):
    """One coded and decoded picture with exact labels."""

    camera: CameraSpec
    picture: Picture
    labels: tuple[Label, ...]


def frame_at(
    renderer: LabellingRenderer, static: StaticWorld, x_m: float, camera: CameraSpec, sky: Atmosphere, chance: Chance
) -> Frame:
    """What the camera sees from a place on the avenue, after JPEG."""
    ego = Pose(x_m=x_m, y_m=float(chance.normal(0, 0.05)), yaw_rad=float(chance.normal(0, 0.004)))
    scene = Scene(static=static, ego=ego, atmosphere=sky, time_s=float(chance.uniform(0, 1000)))
    return taken(renderer, scene, camera, chance)


def taken(renderer: LabellingRenderer, scene: Scene, camera: CameraSpec, chance: Chance) -> Frame:
    """The picture of a scene after JPEG, with its labels."""
    picture, labels = renderer.render(scene, camera), renderer.render_labels(scene, camera)
    coded = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(chance.integers(70, 96))])[1]
    decoded = np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR_RGB), np.uint8)
    return Frame(camera, decoded, tuple(labels))


def drive(split: str, seed: int, frames: int, step_m: float = 4.0) -> Iterator[Frame]:
    """Frames along avenues with changing weather, four of five through the tele camera; every fourth shows a random
    stage instead, with traffic and people."""
    chance = np.random.default_rng([seed, 43])
    world = avenue(40, split, seed)
    renderer = LabellingRenderer(world.static)
    x, sky = 0.0, any_atmosphere(chance, split)
    for number in range(frames):
        if number % 10 == 0:
            sky = any_atmosphere(chance, split)
        x += step_m * float(chance.uniform(0.5, 1.5))
        if x > world.length_m - 60:
            seed += 1
            world, x = avenue(40, split, seed + 7919), 0.0
        camera = TELE if number % 5 else FRONT
        if number % 4 == 0:
            _, scene = random_stage(int(chance.integers(1 << 30)), "train" if split == "train" else "test")
            yield taken(renderer, scene, camera, chance)
        else:
            yield frame_at(renderer, world.static, x, camera, sky, chance)
    renderer.close()


def class_of(label: Label) -> str | None:
    """The reader's class of a labelled object; None for what the reader does not read."""
    if label.kind == "light":
        return f"light:{label.code}" if f"light:{label.code}" in LIGHTS else None
    if label.kind == "panel":
        code = label.code if label.code.startswith("led:") else f"led:{label.code}" if label.code else "led:blank"
        return code if code in PANELS else None
    if label.kind != "sign":
        return None
    for name in (*SIGNS, *PLATES):
        if any(order.country == label.country and order.code == label.code for order in orders(name)):
            return name
    return None
