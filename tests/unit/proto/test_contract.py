"""The contract: schemas in step, golden bytes that still decode, tables that agree with each other."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import topics
from proto.keys import chunk, tool_key, topic_key
from proto.services import SERVICES
from proto.topics import TOPICS, Topic
from scripts.schemas import MESSAGES, of_messages

GOLDEN = Path(__file__).parents[2] / "golden"
NAMES = {row.name for row in SERVICES} | {"evaluation", "*"}


def test_the_schemas_are_in_step() -> None:
    written = {path.name: path.read_bytes() for path in MESSAGES.glob("*.json")}
    assert written == of_messages(), "run: python scripts/schemas.py"


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_golden_bytes_still_decode_and_keep_what_they_said(topic: Topic[Any]) -> None:
    data = (GOLDEN / f"{topic.message.__name__}.{topic.encoding}").read_bytes()
    codec = msgspec.msgpack if topic.encoding == "msgpack" else msgspec.json
    message = codec.decode(data, type=topic.message)
    assert contains(msgspec.to_builtins(message), msgspec.to_builtins(codec.decode(data)))


def contains(new: Any, old: Any) -> bool:
    """Whether everything of `old` is in `new`; `new` may say more."""
    if isinstance(old, dict):
        return isinstance(new, dict) and all(key in new and contains(new[key], value) for key, value in old.items())
    if isinstance(old, list | tuple):
        return len(new) >= len(old) and all(map(contains, new, old))
    return bool(new == old)


def test_every_topic_is_published_and_read_by_services_that_exist() -> None:
    for topic in TOPICS:
        assert topic.publishers
        assert set(topic.publishers) | set(topic.readers) <= NAMES, topic.name


def test_only_the_arbiter_may_actuate_and_only_evaluation_may_read_the_truth() -> None:
    assert {topic.publishers for topic in TOPICS if topic.name.startswith("actuation/")} == {("arbiter",)}
    assert {topic.readers for topic in TOPICS if topic.name.startswith("truth/")} == {("evaluation",)}
    assert topics.CORRUPTED.readers == ("evaluation", "logger"), "who decides must not know what was done to it"


def test_tool_names_are_unique_across_servers() -> None:
    tools = [tool for row in SERVICES for tool in row.tools]
    assert len(tools) == len(set(tools))


@given(st.text(max_size=80))
def test_no_text_becomes_a_key_with_wildcards_or_more_chunks(text: str) -> None:
    try:
        key = tool_key("ego", "rules", text)
    except ValueError:
        return
    assert key.count("/") == 4
    assert not set("*$?#") & set(key)
    assert chunk(text) == text


def test_a_topic_without_an_id_takes_none() -> None:
    with pytest.raises(ValueError, match="has no id"):
        topic_key("ego", topics.EGO, "x")
