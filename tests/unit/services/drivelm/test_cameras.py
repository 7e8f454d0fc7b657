"""How far away a sign or light is, by calibrations of another size and by broken ones."""

import cv2
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from proto import topics
from proto.perception import Boxes
from proto.scene import Fact
from proto.sensors import Calibration, CameraFrame
from services.drivelm.cameras import Calibrations, scaled
from services.drivelm.front_end import FrontEnd
from services.drivelm.service import Bindings, DrivelmConfig
from services.player.street import numbered
from tests.unit.services.drivelm.approach import PICTURE, TELE, Scripted, box_at, says

JPEG = cv2.imencode(".jpg", PICTURE)[1].tobytes()
DOUBLED = scaled(TELE, 2 * TELE.width_px, 2 * TELE.height_px)
BROKEN = [
    msgspec.structs.replace(TELE, fx_px=0.0, fy_px=0.0),
    msgspec.structs.replace(TELE, fy_px=float("nan")),
    msgspec.structs.replace(TELE, cx_px=float("inf")),
    msgspec.structs.replace(TELE, fx_px=-TELE.fx_px),
    msgspec.structs.replace(TELE, width_px=0),
    msgspec.structs.replace(TELE, yaw_rad=float("nan")),
]


def _build(config: ServiceConfig, node: Node) -> None:
    Bindings(DrivelmConfig(), node, FrontEnd(Scripted(lambda q, n: says("light:red")), home="DEU"))


READS_RED = Service("drivelm", ServiceConfig, _build)


def _red_at(*calibrations: Calibration) -> float | None:
    """How far ahead a red light is told that stands 40 m ahead in pictures of 640 x 360, after these calibrations."""
    with bus() as b:
        b.start(READS_RED)
        said = b.collect(topics.FACTS)
        for calibration in calibrations:
            b.probe.publish(topics.CALIBRATION, calibration, id="tele")
        for number in range(4):
            stamp_ns = b.probe.clock.now_ns()
            frame = CameraFrame(jpeg=numbered(JPEG, number), width_px=640, height_px=360, frame=number)
            b.probe.publish(topics.CAMERA, frame, id="tele", stamp_ns=stamp_ns)
            boxes = (box_at(40.0, -3.0, "light", size_m=1.1),)
            b.probe.publish(topics.BOXES, Boxes(camera="tele", frame=number, boxes=boxes), stamp_ns=stamp_ns)
        message = said.wait(lambda facts: _red(facts.facts) is not None)
        red = _red(message.facts)
        return red.distance_m if red is not None else None


def _red(facts: tuple[Fact, ...]) -> Fact | None:
    return next((fact for fact in facts if fact.reading == "light:red" and fact.believed), None)


@pytest.mark.parametrize("calibration", [TELE, DOUBLED], ids=["as large as the pictures", "twice as large"])
def test_a_red_light_is_as_far_away_whatever_size_the_camera_was_calibrated_at(calibration: Calibration) -> None:
    assert _red_at(calibration) == pytest.approx(40.0, abs=1.0)


def test_after_a_broken_calibration_lights_are_read_on_by_the_last_good_one() -> None:
    assert _red_at(TELE, *BROKEN) == pytest.approx(40.0, abs=1.0)
    assert _red_at(*BROKEN) is None, "without a good one nobody knows how far ahead it is, and it is told all the same"


@pytest.mark.parametrize("broken", BROKEN)
def test_impossible_numbers_are_refused_and_the_last_calibration_stays(broken: Calibration) -> None:
    calibrations = Calibrations()
    assert not calibrations.take("tele", broken)
    assert calibrations.of("tele") is None
    assert calibrations.take("tele", TELE)
    assert not calibrations.take("tele", broken)
    assert calibrations.of("tele") is TELE


@given(st.integers(1, 8192), st.integers(1, 8192))
def test_scaling_keeps_where_a_pixel_looks(width_px: int, height_px: int) -> None:
    there = scaled(TELE, width_px, height_px)
    for share in (0.0, 0.3, 1.0):
        assert (share * width_px - there.cx_px) / there.fx_px == pytest.approx((share * 640 - TELE.cx_px) / TELE.fx_px)
        assert (share * height_px - there.cy_px) / there.fy_px == pytest.approx((share * 360 - TELE.cy_px) / TELE.fy_px)
