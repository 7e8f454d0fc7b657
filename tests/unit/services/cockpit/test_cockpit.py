"""The cockpit's service on a real session: its stream, its tools, who is let in."""

import json
import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import httpx2 as httpx
import pytest

from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.node import Node
from drivemcp.runtime.supervisor import free_port
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from proto import topics
from services.cockpit.app import PAGE
from services.cockpit.service import SERVICE, CockpitConfig
from tests.unit.services.cockpit.messages import SILENT, assistance, told

TOKEN = "a-token-of-enough-length"


def build(config: ServiceConfig, node: Node) -> None:
    """Two of the driver's tools."""

    @node.tool(deadline_ms=200, read_only=False)
    def acknowledge() -> dict[str, bool]:
        """End the sound."""
        return {"ended": True}

    @node.tool(deadline_ms=200, read_only=False)
    def feedback(label: Literal["helpful", "late_warning"], tick: int = 0) -> dict[str, str]:
        """A label."""
        if label == "helpful":
            raise ToolFailed("one label every 10 s counts")
        return {"says": f"tick {tick}"}


@pytest.fixture
def running() -> Iterator[tuple[TestBus, Node, str]]:
    """A cockpit beside an orchestrator; the orchestrator's node, and the page's address."""
    with bus() as b:
        orchestrator = b.start(Service("orchestrator", ServiceConfig, build))
        node = b.start(SERVICE)
        assert wait_settled(lambda: {"acknowledge", "feedback"} <= node.catalogue().keys(), 5.0)
        yield b, orchestrator, node.detail["page"]


def events(url: str, wanted: dict[str, int]) -> dict[str, list[Any]]:
    """Events of the stream until so many of each kind have come. A stream that says nothing ends by its timeout."""
    found: dict[str, list[Any]] = {kind: [] for kind in wanted}
    kind = ""
    with httpx.stream("GET", f"{url}events", timeout=10.0) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        for line in answer.iter_lines():
            if line.startswith("event: "):
                kind = line[7:]
            elif line.startswith("data: "):
                found.setdefault(kind, []).append(json.loads(line[6:]))
            if all(len(found[each]) >= count for each, count in wanted.items()):
                return found
    raise AssertionError("the stream ended")


@pytest.fixture
def publishing(running: tuple[TestBus, Node, str]) -> Iterator[None]:
    """The orchestrator speaks ten times a second."""
    stop = threading.Event()

    def publish() -> None:
        while not stop.wait(0.1):
            running[1].publish(topics.SPEED_ASSISTANCE, assistance(30, "mph", assumed=True, plate="when wet"))
            running[1].publish(topics.ADVISORY, told("-30 when\nwet", "warning"))
            running[1].publish(topics.ADVISORY, SILENT)

    thread = threading.Thread(target=publish)
    thread.start()
    yield
    stop.set()
    thread.join(5.0)


@pytest.mark.usefixtures("publishing")
def test_the_stream_brings_speed_advice_and_health(running: tuple[TestBus, Node, str]) -> None:
    found = events(running[2], {"speed": 2, "advisory": 3, "health": 1})
    speed = found["speed"][0]
    assert (speed["known"], speed["limit"]["value"], speed["limit"]["unit"], speed["plate"]) == (
        "assumed", 30, "mph", "when wet",
    )  # fmt: skip
    words = {advisory["kind"]: advisory["directive"] for advisory in found["advisory"]}
    assert words == {"SPEAK": "30 when wet", "SILENT": ""}, "one line, that no command takes for an option"
    assert found["health"][0]["missing"] == []


def test_a_service_that_was_there_and_is_missing_is_told() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with open_bus(BusConfig(mode="peer", listen=(endpoint,))) as ours:
        b = TestBus(ours)
        url = b.start(SERVICE).detail["page"]
        with open_bus(BusConfig(connect=(endpoint,))) as theirs:
            beside = TestBus(theirs)
            beside.start(Service("weather", ServiceConfig, lambda config, node: None))
            assert wait_settled(lambda: events(url, {"health": 1})["health"][0]["missing"] == ["orchestrator"], 10.0)
            beside.start(Service("orchestrator", ServiceConfig, build))
            assert wait_settled(lambda: events(url, {"health": 1})["health"][0]["missing"] == [], 10.0)
            beside.close()
        gone = ["orchestrator", "weather"]
        assert wait_settled(lambda: events(url, {"health": 1})["health"][0]["missing"] == gone, 10.0)
        b.close()


def test_a_page_that_begins_late_is_sent_no_state_that_is_old(running: tuple[TestBus, Node, str]) -> None:
    running[1].publish(topics.SPEED_ASSISTANCE, assistance(50))
    fresh = events(running[2], {"speed": 1})
    assert fresh["speed"][0]["limit"]["value"] == 50
    later = events(running[2], {"health": 4})
    assert "speed" not in events(running[2], {"health": 1}), later


def post(url: str, name: str, body: Any, **headers: str) -> httpx.Response:
    """One touch."""
    return httpx.post(
        f"{url}tool/{name}", content=json.dumps(body), headers={"content-type": "application/json", **headers}
    )


def test_a_touch_calls_the_drivers_tool_and_its_answer_comes_back(running: tuple[TestBus, Node, str]) -> None:
    url = running[2]
    assert post(url, "acknowledge", {}).json() == {"ok": True, "result": {"ended": True}, "error": ""}
    assert post(url, "feedback", {"label": "late_warning", "tick": 7}).json()["result"] == {"says": "tick 7"}
    refused = post(url, "feedback", {"label": "helpful"}).json()
    assert not refused["ok"]
    assert "one label every 10 s" in refused["error"]
    absent = post(url, "ask", {"question": "why"}).json()
    assert not absent["ok"]
    assert absent["error"]


@pytest.mark.parametrize("name", ["arbitrate", "clear_dtcs", "start_scenario", "*", ""])
def test_no_other_tool_can_be_called(running: tuple[TestBus, Node, str], name: str) -> None:
    assert post(running[2], name, {}).status_code == 404


def test_what_another_origin_sends_is_refused(running: tuple[TestBus, Node, str]) -> None:
    url = running[2]
    assert post(url, "acknowledge", {}, origin="http://elsewhere.example").status_code == 403
    assert post(url, "acknowledge", {}, origin=url.rstrip("/")).status_code == 200
    assert httpx.get(url, headers={"host": "elsewhere.example"}).status_code == 421
    assert httpx.post(f"{url}tool/acknowledge", data={"a": "b"}).status_code == 415
    assert post(url, "acknowledge", [1]).status_code == 400


def test_every_answer_has_a_strict_policy_and_the_page_asks_no_other_host(running: tuple[TestBus, Node, str]) -> None:
    for path in ("", "page/main.js", "page/style.css", "nothing"):
        policy = httpx.get(running[2] + path).headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
    for file in PAGE.iterdir():
        text = file.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|innerHTML|\bstyle=|\bon\w+=\"", text), file.name


def test_beyond_this_machine_a_token_is_needed_and_a_browser_brings_it_once(tmp_path: Path) -> None:
    with bus() as b:
        with pytest.raises(ConfigError, match="token_file"):
            b.start(SERVICE, CockpitConfig(host="0.0.0.0"))
        (tmp_path / "token").write_text(TOKEN)
        url = b.start(SERVICE, CockpitConfig(token_file=str(tmp_path / "token"))).detail["page"]
        assert wait_settled(lambda: httpx.get(url).status_code == 303, 5.0)
        assert httpx.get(url).headers["location"] == "/enter"
        assert "form" in httpx.get(f"{url}enter").text
        for path in ("events", "page/main.js", "tool/ask"):
            assert httpx.get(url + path).status_code == 401
        assert httpx.get(url, headers={"authorization": f"Bearer {TOKEN}"}).status_code == 200
        assert httpx.post(f"{url}enter", data={"token": "a-token-that-is-wrong"}).status_code == 401
        with httpx.Client() as browser:
            entered = browser.post(f"{url}enter", data={"token": TOKEN})
            assert (entered.status_code, entered.headers["location"]) == (303, "/")
            kept = entered.headers["set-cookie"]
            assert "HttpOnly" in kept
            assert "SameSite=Strict" in kept
            assert TOKEN not in kept
            assert browser.get(url).status_code == 200
        forged = {"cookie": "drivemcp-cockpit=0000"}
        assert httpx.get(url, headers=forged).status_code == 303


def test_an_address_that_tries_tokens_has_to_wait_and_a_page_without_one_does_not_count(tmp_path: Path) -> None:
    (tmp_path / "token").write_text(TOKEN)
    with bus() as b:
        url = b.start(SERVICE, CockpitConfig(token_file=str(tmp_path / "token"))).detail["page"]
        assert wait_settled(lambda: httpx.get(url).status_code == 303, 5.0)
        assert [httpx.get(f"{url}events").status_code for _ in range(6)] == [401] * 6
        tries = [httpx.post(f"{url}enter", data={"token": "wrong"}).status_code for _ in range(4)]
        assert tries == [401, 401, 401, 429]


def test_a_stream_ends_when_the_service_does() -> None:
    with bus() as b:
        node = b.start(SERVICE)
        begun, ended = threading.Event(), threading.Event()

        def read() -> None:
            try:
                with httpx.stream("GET", f"{node.detail['page']}events", timeout=10.0) as answer:
                    for _ in answer.iter_lines():
                        begun.set()
            except httpx.HTTPError:
                pass
            ended.set()

        thread = threading.Thread(target=read)
        thread.start()
        assert begun.wait(10.0)
        node.close()
        assert ended.wait(10.0)
        thread.join(5.0)
