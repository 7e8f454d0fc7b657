"""Pictures and labels through the renderer's public face."""

import math
from dataclasses import replace

import numpy as np
import pytest

from services.simulator.render.drawing.view import View
from services.simulator.render.models.actors import build_model, world_points
from services.simulator.scene.scene import (
    FRONT,
    TELE,
    Actor,
    Atmosphere,
    CameraSpec,
    Gantry,
    GantryPanel,
    Pose,
    Scene,
    SignFace,
    SignPost,
    StaticWorld,
    TrafficLight,
)
from training.labelling import Label, LabellingRenderer
from training.stages.stage import random_stage

EGO = Pose(x_m=0.0, y_m=0.0)


def car(id_: int, x_m: float, y_m: float = 0.0, **more: object) -> Actor:
    size = {"length_m": 4.4, "width_m": 1.8, "height_m": 1.45}
    return Actor(**({"id": id_, "kind": "saloon", "pose": Pose(x_m=x_m, y_m=y_m), "look_seed": 4} | size | more))  # type: ignore[arg-type]


def scene(static: StaticWorld, *actors: Actor, **more: object) -> Scene:
    return Scene(static=static, ego=EGO, actors=actors, **more)  # type: ignore[arg-type]


def labels_by_id(renderer: LabellingRenderer, subject: Scene, camera: CameraSpec = FRONT) -> dict[int, Label]:
    return {label.id: label for label in renderer.render_labels(subject, camera)}


def test_a_picture_is_rgb_of_the_camera_s_size(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    picture = renderer.render(scene(plain), FRONT)
    assert picture.shape == (360, 640, 3)
    assert picture.dtype == np.uint8
    top, bottom = picture[:40].mean(), picture[-40:].mean()
    assert top > bottom  # the sky is brighter than the road, and up


def test_the_same_scene_gives_the_same_picture_and_another_moment_other_noise(
    renderer: LabellingRenderer, plain: StaticWorld
) -> None:
    subject = scene(plain, car(1, 15.0), time_s=2.0)
    first, again = renderer.render(subject, FRONT), renderer.render(subject, FRONT)
    later = renderer.render(replace(subject, time_s=2.1), FRONT)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, later)
    assert np.abs(first.astype(int) - later).mean() < 12


@pytest.mark.parametrize("yaw_rad", [0.0, 0.6, math.pi])
@pytest.mark.parametrize("camera", [FRONT, TELE])
def test_a_car_s_box_matches_its_projected_shape_within_a_pixel(
    renderer: LabellingRenderer, plain: StaticWorld, yaw_rad: float, camera: CameraSpec
) -> None:
    subject = car(1, 30.0, pose=Pose(x_m=30.0, y_m=1.0, yaw_rad=yaw_rad))
    found = labels_by_id(renderer, scene(plain, subject), camera)[1]
    pixels = View.of(camera, EGO).pixels(world_points(build_model(subject), subject))
    expected = (*pixels.min(axis=0), *pixels.max(axis=0))
    assert found.full_box_px == pytest.approx(expected, abs=1e-3)
    assert found.box_px == pytest.approx(expected, abs=1.5)
    assert found.visible_fraction == pytest.approx(1.0)
    assert found.kind == "vehicle"


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.8])
def test_a_walking_pedestrian_s_box_follows_the_step(
    renderer: LabellingRenderer, plain: StaticWorld, phase: float
) -> None:
    walker = Actor(
        id=9,
        kind="pedestrian",
        pose=Pose(x_m=12.0, y_m=2.0, yaw_rad=1.5),
        length_m=0.5,
        width_m=0.5,
        height_m=1.8,
        walk_phase=phase,
    )
    found = labels_by_id(renderer, scene(plain, walker))[9]
    assert found.kind == "pedestrian"
    assert found.box_px == pytest.approx(found.full_box_px, abs=1.5)


def test_what_stands_behind_another_is_less_visible(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    found = labels_by_id(renderer, scene(plain, car(1, 14.0), car(2, 21.0, 1.2)))
    assert found[1].visible_fraction == pytest.approx(1.0)
    assert 0.05 < found[2].visible_fraction < 0.75
    assert found[2].box_px[0] == pytest.approx(found[2].full_box_px[0], abs=1.5)  # its left side is free


def test_what_is_wholly_hidden_has_no_label(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    lorry = Actor(
        id=1, kind="lorry", pose=Pose(x_m=16.0, y_m=0.0), length_m=8.0, width_m=2.5, height_m=3.6, mesh_family=0
    )
    assert set(labels_by_id(renderer, scene(plain, lorry, car(2, 40.0)))) == {1}


def test_a_car_cut_by_the_picture_s_edge_counts_as_partly_visible(
    renderer: LabellingRenderer, plain: StaticWorld
) -> None:
    found = labels_by_id(renderer, scene(plain, car(1, 10.0, 6.2)))[1]
    assert found.box_px[0] == 0.0
    assert found.full_box_px[0] < 0
    assert found.visible_fraction < 0.95


@pytest.mark.parametrize("distance_m", [15.0, 30.0, 43.0])
def test_a_sign_s_disc_has_the_size_the_pinhole_predicts(
    renderer: LabellingRenderer, plain: StaticWorld, distance_m: float
) -> None:
    post = SignPost(
        id=50,
        pose=Pose(x_m=distance_m, y_m=-2.0, yaw_rad=math.pi),
        faces=(SignFace(country="DEU", code="limit:50", size_m=0.6),),
        height_m=2.0,
    )
    static = replace(plain, signs=(post,))
    found = labels_by_id(renderer, scene(static), TELE)[50]
    depth = float(View.of(TELE, EGO).camera_points(np.array([[distance_m, -2.0, 2.0]]))[0, 2])
    assert found.disc_px == pytest.approx(TELE.focal_px * 0.6 / depth)
    assert found.box_px[3] - found.box_px[1] == pytest.approx(found.disc_px, abs=2.0)
    assert (found.kind, found.code, found.country) == ("sign", "limit:50", "DEU")


def test_stacked_faces_are_labelled_one_by_one_from_the_top(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    faces = (SignFace(country="DEU", code="limit:80"), SignFace(country="DEU", code="plate:when_wet:drawn"))
    post = SignPost(id=50, pose=Pose(x_m=15.0, y_m=-3.0, yaw_rad=math.pi), faces=faces)
    labels = [x for x in renderer.render_labels(scene(replace(plain, signs=(post,))), FRONT) if x.id == 50]
    upper, lower = sorted(labels, key=lambda label: label.part)
    assert (upper.code, lower.code) == ("limit:80", "plate:when_wet:drawn")
    assert upper.box_px[3] <= lower.box_px[1] + 1


def test_a_sign_seen_from_behind_has_no_label(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    face = (SignFace(country="DEU", code="limit:80"),)
    post = SignPost(id=50, pose=Pose(x_m=15.0, y_m=-3.0, yaw_rad=0.0), faces=face)
    assert renderer.render_labels(scene(replace(plain, signs=(post,))), FRONT) == []


def test_gantry_panels_show_the_scene_s_code_and_nothing_when_dark(
    renderer: LabellingRenderer, plain: StaticWorld
) -> None:
    panels = (GantryPanel(id=7, lateral_m=1.7, country="DEU", code="led:80"),)
    gantry = Gantry(id=70, pose=Pose(x_m=25.0, y_m=0.0, yaw_rad=math.pi), span_m=12.0, panels=panels)
    static = replace(plain, gantries=(gantry,))
    shown = labels_by_id(renderer, scene(static, panels={7: "led:60"}))[7]
    assert (shown.kind, shown.code) == ("panel", "led:60")
    centre_u = (shown.box_px[0] + shown.box_px[2]) / 2
    assert centre_u < 320  # lateral is left positive for the approaching driver
    assert labels_by_id(renderer, scene(static, panels={7: ""})) == {}


@pytest.mark.parametrize(("state", "channel", "row"), [("red", 0, 0.2), ("green", 1, 0.8)])
def test_a_traffic_light_shines_in_its_state_s_colour_and_place(
    renderer: LabellingRenderer, plain: StaticWorld, state: str, channel: int, row: float
) -> None:
    light = TrafficLight(id=8, pose=Pose(x_m=9.0, y_m=-2.0, yaw_rad=math.pi), height_m=2.0)
    subject = scene(replace(plain, lights=(light,)), lights={8: state})
    label = labels_by_id(renderer, subject)[8]
    assert (label.kind, label.code) == ("light", state)
    left, top, right, bottom = (int(v) for v in label.box_px)
    head = renderer.render(subject, FRONT)[top:bottom, left:right].astype(float)
    colourful = head[:, :, channel] - head[:, :, 2 if channel == 0 else 0]
    peak = np.unravel_index(int(colourful.argmax()), colourful.shape)[0] / len(head)
    assert peak == pytest.approx(row, abs=0.15)


@pytest.mark.parametrize("sky", [Atmosphere(cloud=1.0), Atmosphere(fog_visibility_m=80.0), Atmosphere(night=True)])
def test_an_unlit_lamp_has_its_own_colour_or_none_never_the_opposite(
    renderer: LabellingRenderer, plain: StaticWorld, sky: Atmosphere
) -> None:
    light = TrafficLight(id=8, pose=Pose(x_m=9.0, y_m=-2.0, yaw_rad=math.pi), height_m=2.0, state="off")
    subject = scene(replace(plain, lights=(light,)), atmosphere=sky)
    left, top, right, bottom = (int(v) for v in labels_by_id(renderer, subject)[8].box_px)
    head = renderer.render(subject, FRONT)[top:bottom, left:right].astype(float)
    middle = head[:, int(0.4 * head.shape[1]) : int(0.6 * head.shape[1]) + 1].mean(axis=1)
    red, green = (middle[int(share * len(head))] - middle[int(0.36 * len(head))] for share in (0.21, 0.79))
    assert red[0] - red[2] > -3  # beside the housing between the lamps
    assert green[1] - green[0] > -3


def test_fog_takes_contrast_and_night_takes_light(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    def picture(atmosphere: Atmosphere) -> np.ndarray:
        return renderer.render(scene(plain, car(1, 40.0), atmosphere=atmosphere), FRONT).astype(float)

    clear = picture(Atmosphere(cloud=0.3))
    foggy = picture(Atmosphere(fog_visibility_m=60.0))
    night = picture(Atmosphere(night=True))
    assert foggy[150:220].std() < 0.5 * clear[150:220].std()
    assert night.mean() < 0.5 * clear.mean()


def test_rain_darkens_the_road(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    dry = renderer.render(scene(plain, atmosphere=Atmosphere(cloud=1.0)), FRONT)
    wet = renderer.render(scene(plain, atmosphere=Atmosphere(cloud=1.0, wetness=1.0)), FRONT)
    assert wet[300:350, 250:390].mean() < 0.9 * dry[300:350, 250:390].mean()


def test_brake_lamps_redden_the_rear(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    def red(braking: bool) -> float:
        subject = scene(plain, car(1, 9.0, braking=braking))
        left, top, right, bottom = (int(v) for v in labels_by_id(renderer, subject)[1].box_px)
        crop = renderer.render(subject, FRONT)[top:bottom, left:right].astype(float)
        return float(np.percentile(crop[:, :, 0] - crop[:, :, 1], 99))

    assert red(braking=True) > red(braking=False) + 20


def test_signs_shine_back_at_night(renderer: LabellingRenderer, plain: StaticWorld) -> None:
    face = (SignFace(country="DEU", code="limit:80"),)
    post = SignPost(id=50, pose=Pose(x_m=20.0, y_m=-3.0, yaw_rad=math.pi), faces=face)
    subject = scene(replace(plain, signs=(post,)), atmosphere=Atmosphere(night=True))
    left, top, right, bottom = (int(v) for v in labels_by_id(renderer, subject)[50].box_px)
    picture = renderer.render(subject, FRONT).astype(float)
    assert np.percentile(picture[top:bottom, left:right], 90) > 3 * picture[:80].mean()


def test_labels_of_a_busy_stage_lie_inside_the_picture(renderer: LabellingRenderer) -> None:
    _, subject = random_stage(3, "train")
    labels = renderer.render_labels(subject, FRONT)
    assert {"vehicle"} <= {label.kind for label in labels}
    for label in labels:
        left, top, right, bottom = label.box_px
        assert 0 <= left < right <= 640
        assert 0 <= top < bottom <= 360
        assert 0.0 < label.visible_fraction <= 1.0 + 1e-9
        assert left >= label.full_box_px[0] - 1.5
        assert bottom <= label.full_box_px[3] + 1.5
