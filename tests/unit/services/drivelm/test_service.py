"""The service on a real in-process bus: pictures and boxes in, facts, graph and tool answers out."""

import base64
from contextlib import suppress
from typing import Any

import cv2
import msgspec
import numpy as np

from app.pictures import unpacked
from drivemcp.bus.session import wait_settled
from drivemcp.testing import Collected, TestBus, bus
from proto import topics
from proto.decision import Advisory
from proto.perception import Box, Boxes, Track, Tracks
from proto.scene import Fact, SceneGraph
from proto.sensors import CameraFrame
from proto.vehicle import Ego
from services.drivelm.service import SERVICE, DrivelmConfig
from services.simulator.signart import draw_face
from tests.golden.make import sample
from tests.unit.services.drivelm.approach import NS, TELE, box_at


def _picture(distance_m: float) -> bytes:
    """A limit sign before grey, as the camera would have it at that distance."""
    picture = np.full((360, 640, 3), 130, np.uint8)
    box = box_at(distance_m, -3.5)
    size = round(box.x1_px - box.x0_px)
    face = draw_face("DEU", "limit:80", size_px=size)
    x, y = round(box.x0_px), round(box.y0_px)
    share = face[..., 3:] / 255
    part = picture[y : y + face.shape[0], x : x + face.shape[1]]
    part[...] = (face[..., 2::-1] * share + part * (1 - share)).astype(np.uint8)
    return bytes(cv2.imencode(".jpg", picture)[1].tobytes())


def test_a_drive_past_a_sign_gives_a_believed_fact_and_an_answer() -> None:
    with bus() as b:
        b.start(SERVICE, DrivelmConfig(stale_ms=60_000))
        probe, said = b.probe, b.collect(topics.FACTS)
        graphs = b.collect(topics.GRAPH)
        probe.publish(topics.CALIBRATION, TELE, id="tele")
        failed = b.call("ask_scene", {"question": "What is the speed limit?"})
        assert failed.status == "tool_error"
        for number, distance_m in enumerate((45.0, 40.0, 36.0, 32.0, 28.0, 25.0)):
            stamp_ns = probe.clock.now_ns()
            frame = CameraFrame(jpeg=_picture(distance_m), width_px=640, height_px=360, frame=number)
            probe.publish(topics.CAMERA, frame, id="tele", stamp_ns=stamp_ns)
            for camera in ("tele", "front"):
                boxes = (box_at(distance_m, -3.5),) if camera == "tele" else ()
                probe.publish(topics.BOXES, Boxes(camera=camera, frame=number, boxes=boxes), stamp_ns=stamp_ns)
        message = said.wait(lambda facts: _limit(facts.facts) is not None)
        believed = _limit(message.facts)
        assert believed is not None
        assert (believed.reading, believed.value, believed.unit, believed.track_id) == ("limit:80", 80, "km/h", 7)
        assert believed.frame_stamp_ns > NS
        until_shown(b, graphs)
        assert b.call("describe_scene").ok
        answer = b.call("ask_scene", {"question": "What is the speed limit?"})
        assert answer.result is not None
        assert "extractive" in answer.result["method"]
        said.wait(lambda facts: any(fact.kind == "jurisdiction" for fact in facts.facts))


def _limit(facts: tuple[Fact, ...]) -> Fact | None:
    return next((fact for fact in facts if fact.kind == "limit" and fact.believed), None)


CAR = Box(x0_px=300, y0_px=150, x1_px=360, y1_px=200, kind="vehicle", score=0.9, track_id=3)
AHEAD = Track(track_id=3, kind="vehicle", x_m=30.0, y_m=0.0, vx_mps=0.0, vy_mps=0.0, confidence=0.95, in_ego_path=True)


def until_shown(b: TestBus, graphs: Collected[SceneGraph]) -> set[int]:
    """Boxes of the front camera, ten times a second, until another graph comes; their stamps."""
    count, stamps = len(graphs.messages), set[int]()
    for _ in range(100):
        stamp_ns = b.probe.clock.now_ns()
        stamps.add(stamp_ns)
        b.probe.publish(topics.BOXES, Boxes(camera="front", frame=len(stamps), boxes=(CAR,)), stamp_ns=stamp_ns)
        with suppress(TimeoutError):
            graphs.wait_count(count + 1, timeout_s=0.1)
            return stamps
    raise TimeoutError("no graph of 100 pictures")


def test_the_graph_has_its_pictures_stamp_and_ends_with_the_camera() -> None:
    with bus() as b:
        b.start(SERVICE)
        graphs = b.collect(topics.GRAPH)
        b.probe.client.discover()
        for _ in range(10):  # what is shown is told of for a second: a machine that stalls asks too late
            stamps = until_shown(b, graphs)
            if b.call("describe_scene").ok:
                break
        else:
            raise AssertionError("no graph could be described")
        assert graphs.infos[-1].stamp_ns in stamps
        b.collect(topics.HEALTH, id="drivelm").wait_count(3)  # said once a second, as the graph is
        outcomes = [
            b.call(tool, asked) for tool, asked in (("describe_scene", {}), ("ask_scene", {"question": "Cars?"}))
        ]
        assert {outcome.status for outcome in outcomes} == {"tool_error"}
        assert "within the last second" in outcomes[0].error
        later = until_shown(b, graphs)
        assert graphs.infos[-1].stamp_ns in later


def test_tracks_and_motion_that_fell_silent_are_in_no_graph() -> None:
    with bus() as b:
        b.start(SERVICE)
        graphs = b.collect(topics.GRAPH)
        b.probe.publish(topics.TRACKS, Tracks(camera="front", frame=1, tracks=(AHEAD,)))
        b.probe.publish(topics.EGO, Ego(speed_mps=20.0))
        for _ in range(3):
            until_shown(b, graphs)
        assert "30 m ahead" not in graphs.messages[-1].description
        assert not [qa for qa in graphs.messages[-1].qa if qa.layer == "behavior" and "fast" in qa.answer]


def test_the_picture_that_was_decided_on_is_shown_with_its_boxes_and_that_of_a_message_for_longer() -> None:
    with bus() as b:
        b.start(SERVICE)
        gateway = b.node("gateway")
        for number in range(30):
            stamp_ns = b.probe.clock.now_ns()
            frame = CameraFrame(jpeg=_picture(45.0 - number / 2), width_px=640, height_px=360, frame=number)
            b.probe.publish(topics.CAMERA, frame, id="front", stamp_ns=stamp_ns)
            b.probe.publish(topics.BOXES, Boxes(camera="front", frame=number, boxes=(CAR,)), stamp_ns=stamp_ns)
            told = msgspec.structs.replace(
                sample(Advisory), tick=number, snapshot_stamp_ns=stamp_ns, kind="SPEAK" if number == 3 else "SILENT"
            )
            b.probe.publish(topics.ADVISORY, told, stamp_ns=stamp_ns)

        def shown(**which: int) -> np.ndarray[Any, np.dtype[np.uint8]] | None:
            found = b.call("decided_picture", which, caller=gateway)
            return None if found.result is None else unpacked(base64.b64decode(found.result["jpeg_base64"]))

        assert wait_settled(lambda: shown(tick=29) is not None, 10.0)
        newest, message = shown(frame=29), shown(tick=3)
        assert message is not None
        assert newest is not None
        assert newest.shape == (360, 640, 3)
        edge = newest[155:195, 300].astype(int)
        assert (edge.max(axis=1) - edge.min(axis=1)).mean() > 60, "the box is drawn in its colour"
        assert shown(tick=4) is None
        assert shown(frame=4) is None
        assert b.call("decided_picture", {"tick": 3}).status == "protocol_error"
