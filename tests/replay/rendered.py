"""Three short lockstep drives with rendered sensors: what simulator, perception, front end and advice publish, message by message."""

import platform
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from drivemcp.bus.received import Received
from drivemcp.node import Node
from evaluation.run.grant import granted
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec
from proto import topics
from proto.topics import Topic
from tests.replay.files import stated

WATCHED: tuple[Topic[Any], ...] = (topics.TRUTH, topics.TRACKS, topics.FACTS, topics.CONDITIONS, topics.ADVISORY)
EXACT = frozenset({topics.TRUTH.name})
"""Not read from pixels: the same on every processor. The others are compared bit by bit on the lock's processor alone."""
MEASURED = frozenset({"latency_ms", "event_to_advice_ms", "snapshot_to_advice_ms"})


class Rendered(NamedTuple):
    """One of them."""

    scenario: str
    seconds: float
    seed: int = 1


RENDERED: Mapping[str, Rendered] = {
    "urb-rain": Rendered("urb-rain", 2.0),
    "cross-border": Rendered("cross-border", 2.0),
    "dynamic-vsl": Rendered("dynamic-vsl", 2.0),
}


def published(name: str) -> dict[str, list[Any]]:
    """Topic -> its messages in the order in which they were published, without measured times."""
    wanted, found = RENDERED[name], {topic.name: list[Any]() for topic in WATCHED}
    spec = RunSpec(
        scenario=wanted.scenario, seed=wanted.seed, seconds=wanted.seconds,
        settings={"logger": {"pictures": "none"}},
    )  # fmt: skip

    def observe(node: Node) -> None:
        for topic in WATCHED:

            def keep(message: Any, info: Received[Any], name: str = topic.name) -> None:
                fields = stated(message)
                found[name].append([info.seq, {key: value for key, value in fields.items() if key not in MEASURED}])

            node.subscribe(topic, keep)

    with tempfile.TemporaryDirectory() as folder:
        drive(granted(spec, Path(folder)), Path(folder), observe)
    return {name: [message for _, message in sorted(each, key=lambda one: one[0])] for name, each in found.items()}


def outline(messages: Mapping[str, list[Any]]) -> dict[str, list[str]]:
    """What was seen at all, whatever the processor: signs and lights read, kinds of road users, words spoken."""
    facts = {
        f"{fact['kind']} {fact['reading']}"
        for each in messages[topics.FACTS.name]
        for fact in each.get("facts", ())
        if fact["confidence"] >= 0.8
    }
    kinds = {
        track["kind"]
        for each in messages[topics.TRACKS.name]
        for track in each.get("tracks", ())
        if track["confidence"] >= 0.8
    }
    said = {each["directive"] for each in messages[topics.ADVISORY.name] if each["kind"] != "SILENT"}
    return {"facts": sorted(facts), "kinds": sorted(kinds), "said": sorted(said)}


def processor() -> str:
    """Maker and instruction set of the machine, and the C library: what decides the last bit of pixels and networks."""
    told: dict[str, str] = {}
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        told = {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in reversed(lines))}
    simd = sorted({"avx2", "avx512f", "avx512_vnni", "avx_vnni"} & set(told.get("flags", "").split()))
    return " ".join((platform.machine(), told.get("vendor_id", ""), *simd, "-".join(platform.libc_ver())))
