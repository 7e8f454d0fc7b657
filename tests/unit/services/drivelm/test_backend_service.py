"""The real service with a chat endpoint on loopback: what it says is heard, weighed, aged, traced, and waited for by nobody."""

import sys
from http.server import BaseHTTPRequestHandler

import cv2
import msgspec
import numpy as np
import pytest

from drivemcp.config import load_config, settings_of
from drivemcp.errors import ConfigError
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.perception import Boxes
from proto.scene import Fact, Facts
from proto.sensors import CameraFrame
from services.drivelm.backends.config import OpenaiConfig, TransformersConfig
from services.drivelm.backends.prompts import load
from services.drivelm.service import SERVICE, DrivelmConfig
from services.drivelm.vocabulary.classes import QUESTIONS, SENTENCES
from services.orchestrator.service import SERVICE as ORCHESTRATOR
from services.orchestrator.service import OrchestratorConfig
from services.simulator.signart import draw_face
from tests.unit.services.drivelm.approach import TELE, box_at
from tests.unit.services.drivelm.chat_server import Asked, ChatServer, chat_server, completion, send

PLATE = load().texts[QUESTIONS["plate"]]
DISTANCES_M = np.geomspace(45.0, 22.0, 14).tolist()


def _jpeg(distance_m: float, label: str) -> bytes:
    """A sign before grey, as the camera would have it at that distance."""
    picture, box = np.full((360, 640, 3), 130, np.uint8), box_at(distance_m, -3.5)
    face = draw_face("DEU", label, size_px=round(box.x1_px - box.x0_px))
    part = picture[round(box.y0_px) :, round(box.x0_px) :][: face.shape[0], : face.shape[1]]
    share = face[..., 3:] / 255
    part[...] = (face[..., 2::-1] * share + part * (1 - share)).astype(np.uint8)
    return bytes(cv2.imencode(".jpg", picture)[1].tobytes())


def _config(server: ChatServer, **options: object) -> DrivelmConfig:
    openai = OpenaiConfig(base_url=server.url, model="tiny-vlm", timeout_s=8.0)
    return DrivelmConfig(backend="openai", openai=openai, **options)  # type: ignore[arg-type]


def _drive(b: TestBus, label: str, server: ChatServer | None = None) -> None:
    """Publish an approach; with a server, wait at each picture until both its questions were asked."""
    b.probe.publish(topics.CALIBRATION, TELE, id="tele")
    for number, distance_m in enumerate(DISTANCES_M):
        stamp_ns = b.probe.clock.now_ns()
        frame = CameraFrame(jpeg=_jpeg(distance_m, label), width_px=640, height_px=360, frame=number)
        b.probe.publish(topics.CAMERA, frame, id="tele", stamp_ns=stamp_ns)
        boxes = Boxes(camera="tele", frame=number, boxes=(box_at(distance_m, -3.5),))
        b.probe.publish(topics.BOXES, boxes, stamp_ns=stamp_ns)
        if server is not None:
            server.wait_asked(2 * (number + 1))


class Speaker:
    """Says one thing of signs, and nothing of plates and, unless it is blind, of blank pictures."""

    def __init__(self, text: str, *, blind: bool = False) -> None:
        self._text, self._blind = text, blind

    def __call__(self, asked: Asked, handler: BaseHTTPRequestHandler) -> None:
        seen = asked.prompt != PLATE and (self._blind or asked.picture.std(axis=(0, 1)).max() > 1.0)
        send(handler, completion(self._text if seen else SENTENCES["other"], logprob=-0.002))


def _limits(facts: Facts) -> list[Fact]:
    return [fact for fact in facts.facts if fact.kind == "limit"]


def test_an_endpoint_that_sees_what_the_sign_reader_sees_is_believed_and_named_in_the_facts() -> None:
    with chat_server(Speaker(SENTENCES["limit:80"])) as server, bus() as b:
        node = b.start(SERVICE, _config(server))
        said = b.collect(topics.FACTS)
        _drive(b, "limit:80", server)
        agreed = said.wait(lambda facts: any(each.believed and not each.grounding for each in _limits(facts)))
        (fact,) = _limits(agreed)
        assert (fact.value, fact.unit) == (80, "km/h")
        assert agreed.backend == f"openai:tiny-vlm prompts:{load().sha256[:12]}"
        assert node.detail["prompts"] == load().sha256
        assert {max(asked.picture.shape) for asked in server.asked} == {224}


def test_an_endpoint_that_says_the_same_of_a_blank_picture_loses_its_word() -> None:
    with chat_server(Speaker(SENTENCES["limit:80"], blind=True)) as server, bus() as b:
        b.start(SERVICE, _config(server))
        said = b.collect(topics.FACTS)
        _drive(b, "limit:80", server)
        blind = said.wait(
            lambda facts: any("do not change with the picture" in each.grounding for each in _limits(facts))
        )
        (fact,) = _limits(blind)
        assert (fact.value, fact.believed) == (80, True)  # as the sign reader alone has read it
        assert fact.grounding.startswith("read by the sign reader alone")


def test_every_trace_names_the_front_end_and_its_prompts() -> None:
    with chat_server(Speaker(SENTENCES["limit:80"])) as server, bus() as b:
        b.start(ORCHESTRATOR, OrchestratorConfig(silence_s=0.2, start_s=0.1))
        b.start(SERVICE, _config(server))
        named = b.wait_for(topics.TRACE, lambda trace: "front_end" in trace.versions)
        assert named.versions["front_end"] == f"openai:tiny-vlm prompts:{load().sha256[:12]}"


def test_a_higher_limit_than_the_sign_reader_sees_is_never_sure() -> None:
    with chat_server(Speaker(SENTENCES["limit:130"])) as server, bus() as b:
        b.start(SERVICE, _config(server))
        said = b.collect(topics.FACTS)
        _drive(b, "limit:80", server)
        said.wait(lambda facts: any(each.value == 130 or "130" in each.grounding for each in _limits(facts)))
        raised = [each for facts in said.messages for each in _limits(facts) if each.value == 130]
        assert not [each for each in raised if each.believed]
        assert all(each.confidence < 0.6 and each.grounding for each in raised)


def test_an_endpoint_that_never_answers_delays_nothing() -> None:
    servers: list[ChatServer] = []

    def silent(asked: Asked, handler: BaseHTTPRequestHandler) -> None:
        servers[0].release.wait(60.0)  # longer than anything here: who waited for it would come too late

    with chat_server(silent) as server, bus() as b:
        servers.append(server)
        openai = OpenaiConfig(base_url=server.url, model="tiny-vlm", timeout_s=60.0)
        b.start(SERVICE, DrivelmConfig(backend="openai", openai=openai))
        said = b.collect(topics.FACTS)
        _drive(b, "limit:80")
        read = said.wait(lambda facts: any(each.believed for each in _limits(facts)))
        assert _limits(read)[0].value == 80
        assert _limits(read)[0].grounding == "read by the sign reader alone"
        assert len(server.asked) <= 2


def _refused(config: DrivelmConfig) -> str:
    with bus() as b, pytest.raises(ConfigError) as caught:
        b.start(SERVICE, config)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_settings_that_cannot_be_used_are_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _refused(DrivelmConfig(backend="oracle")) == (
        "drivelm.backend is 'oracle'; there is: embedded, transformers, openai"
    )
    assert "drivelm.openai.base_url is missing" in _refused(DrivelmConfig(backend="openai"))
    lockstep = DrivelmConfig(backend="openai", lockstep=True, openai=OpenaiConfig(base_url="https://x.org", model="m"))
    assert "not for lockstep" in _refused(lockstep)
    for name, module in (("openai", "httpx2"), ("transformers", "torch")):
        monkeypatch.setitem(sys.modules, module, None)
        said = _refused(DrivelmConfig(backend=name, transformers=TransformersConfig(folder="/no/such")))
        assert module in said
        assert f"pip install 'drivemcp[drivelm-{name}]'" in said


def test_settings_are_read_from_the_command_line_and_unknown_ones_refused() -> None:
    settings = ["backend=openai", "openai.base_url=http://127.0.0.1:8000/v1", "openai.model=m", "outstanding=3"]
    config = load_config(DrivelmConfig, None, settings)
    assert (config.openai.base_url, config.outstanding) == ("http://127.0.0.1:8000/v1", 3)
    whole = settings_of(["drivelm.backend=openai", "drivelm.openai.model=m", "drivelm.openai.timeout_s=2"])
    assert whole == {"drivelm": {"backend": "openai", "openai": {"model": "m", "timeout_s": 2}}}
    for wrong in ("openai.api_key=sk-1", "openai.timeout_s=0", "outstanding=0", "transformers.max_tokens=100000"):
        with pytest.raises(ConfigError, match=r"\$\."):
            load_config(DrivelmConfig, None, [wrong])
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"openai": {"surprise": 1}}, DrivelmConfig)
