"""Pictures in results: those of the front end, never more than 200 kB, and none where there is none."""

import base64
from typing import Any

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcp import types
from mcp.client.client import Client

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.errors import ToolFailed
from drivemcp.node import Node
from drivemcp.service import Service
from proto.tools import Outcome
from services.gateway.images import MOST_BYTES, _image
from services.gateway.service import SERVICE, GatewayConfig
from tests.unit.services.gateway.conftest import Running

JPEG = b"\xff\xd8\xff picture \xff\xd9"


def build_drivelm(config: ServiceConfig, node: Node) -> None:
    """Picture 5, and that of tick 7."""

    @node.tool(deadline_ms=50)
    def ask_scene(question: str) -> dict[str, Any]:
        """Answers from picture 5, or from one that is gone."""
        return {"answer": "a car", "frame": 5 if question == "now" else 4}

    @node.tool(deadline_ms=50)
    def decided_picture(tick: int | None = None, frame: int | None = None) -> dict[str, Any]:
        """As the front end's."""
        if tick == 7 or frame == 5:
            return {"jpeg_base64": base64.b64encode(JPEG).decode()}
        raise ToolFailed("no picture of it is kept")


@pytest.mark.parametrize("images", [True, False])
def test_answers_come_with_their_picture_unless_it_is_gone_or_switched_off(running: Running, images: bool) -> None:
    running.bus.start(Service("drivelm", ServiceConfig, build_drivelm))
    gateway = running.bus.start(SERVICE, GatewayConfig(images=images))
    assert wait_settled(lambda: {"decided_picture", "explain_decision"} <= gateway.catalogue().keys(), 5.0)

    async def pictures(client: Client, tool: str, **arguments: Any) -> list[bytes]:
        found = await client.call_tool(tool, arguments)
        assert isinstance(found.content[0], types.TextContent)
        return [base64.b64decode(each.data) for each in found.content if isinstance(each, types.ImageContent)]

    async def talk() -> None:
        async with Client(gateway.detail["mcp"]) as client:
            assert "decided_picture" not in {tool.name for tool in (await client.list_tools()).tools}
            shown = [JPEG] if images else []
            assert await pictures(client, "ask_scene", question="now") == shown
            assert await pictures(client, "explain_decision") == shown
            assert await pictures(client, "ask_scene", question="then") == []
            assert await pictures(client, "explain_decision", tick=8) == []
            assert await pictures(client, "vehicle_health") == []

    anyio.run(talk)


@given(
    st.one_of(
        st.integers(MOST_BYTES - 5, MOST_BYTES + 5).map(lambda size: base64.b64encode(b"\xff\xd8" + b"a" * size).decode()),
        st.text(max_size=50), st.none(), st.integers(), st.binary(max_size=90).map(lambda data: base64.b64encode(data).decode()),
    )
)  # fmt: skip
def test_whatever_the_front_end_answers_a_picture_has_at_most_200_kb(data: Any) -> None:
    for block in _image(Outcome(tool="decided_picture", status="ok", result={"jpeg_base64": data})):
        assert isinstance(block, types.ImageContent)
        assert len(base64.b64decode(block.data)) <= MOST_BYTES
