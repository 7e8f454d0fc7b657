"""The logger on a real bus."""

import hmac
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from jsonschema import Draft202012Validator  # type: ignore[import-untyped]

from drivemcp import node as node_module
from drivemcp.bus.inbox import Inbox
from drivemcp.config import load_config
from drivemcp.errors import ConfigError
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.health import ServiceLog
from proto.sensors import CameraFrame, CanFrame, CanFrames
from proto.topics import Topic
from proto.vehicle import Ego
from services.logger.format import signing
from services.logger.format.reader import Logged, messages
from services.logger.memory import MemoryStore, kept_head
from services.logger.service import SERVICE, LoggerConfig
from services.logger.verification import trust
from services.logger.verification.verifier import verify
from services.logger.view.settings import ViewSettings
from services.logger.writing import anchor, log_folder
from services.logger.writing.recorder import Recorder
from services.logger.writing.topic_formats import LOGGED, json_form
from services.logger.writing.withheld import TOPIC, Withheld
from tests.unit.services.logger.conftest import trace_of

replace = msgspec.structs.replace


def _logged(b: TestBus, folder: Path, publish: Sequence[tuple[Topic[Any], msgspec.Struct, str | None]]) -> list[Logged]:
    """What stands in the log after these were published and the logger was closed."""
    node = b.start(SERVICE, LoggerConfig(out_dir=str(folder), flush_ms=10))
    for topic, message, id in publish:
        b.probe.publish(topic, message, id=id, stamp_ns=42)
    b.wait_for(topics.CHAIN, lambda head: head.records >= len(publish))
    node.close()
    (path,) = log_folder.logs(folder / "logs")
    assert verify(path).closed
    return [one for one in messages(path) if one.name.split("/")[0] not in ("health", "calls", "log")]


def test_what_the_topic_table_wants_logged_is_logged_and_raw_bus_frames_and_sweeps_are_not(tmp_path: Path) -> None:
    frames = CanFrames(frames=(CanFrame(stamp_ns=1, arbitration_id=2, data=b"3"),))
    with bus() as b:
        logged = _logged(
            b,
            tmp_path,
            [
                (topics.CAN_TX, frames, "vehicle"),
                (topics.EGO, Ego(speed_mps=12.5), None),
                (topics.CAMERA, CameraFrame(jpeg=b"\xff\xd8picture", width_px=1, height_px=1), "front"),
            ],
        )
    assert [one.name for one in logged] == ["can/vehicle/tx", "can/ego", "sensor/camera/front"]
    assert all(one.stamp_ns == 42 for one in logged)
    assert msgspec.json.decode(logged[0].data, type=CanFrames) == frames
    assert msgspec.json.decode(logged[1].data, type=Ego) == Ego(speed_mps=12.5)
    image = CompressedImage.FromString(logged[2].data)
    assert (image.data, image.format, image.frame_id) == (b"\xff\xd8picture", "jpeg", "front")
    assert {topics.CAN_RX, topics.LIDAR, topics.TRUTH}.isdisjoint(LOGGED)


def test_a_trace_is_kept_byte_for_byte_and_found_again(tmp_path: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10))
        b.probe.publish(topics.TRACE, trace_of(7))
        b.wait_for(topics.CHAIN, lambda head: head.records > 0)
        found = b.call("find_traces", {"event": "overspeed"}).result
        versions = b.call("recall", {"kind": "rulepack"}).result
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    assert found is not None
    assert [(row["tick"], row["decision"], row["file"]) for row in found["traces"]] == [(7, "SPEAK", path.name)]
    assert versions is not None
    assert versions["entries"][0]["value"] == {"rulepack": "DEU-v1@1.0.0"}
    (data,) = [one.data for one in messages(path) if one.name == "trace"]
    assert data == msgspec.json.encode(trace_of(7))


def test_what_is_remembered_is_recalled_and_nonsense_is_refused(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path)))
        assert b.call("remember", {"kind": "preferences", "key": "driver", "value": {"unit": "mph"}}).ok
        recalled = b.call("recall", {"kind": "preferences", "key": "driver"}).result
        assert recalled is not None
        assert recalled["entries"][0]["value"] == {"unit": "mph"}
        assert b.call("remember", {"kind": "gossip", "key": "k", "value": {}}).status == "tool_error"
        assert b.call("remember", {"kind": "note", "key": "k", "value": {"x": "y" * 70_000}}).status == "tool_error"


def test_the_signed_head_goes_onto_the_bus_and_into_memory(tmp_path: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10))
        b.probe.publish(topics.EGO, Ego(speed_mps=1.0))
        head = b.wait_for(topics.CHAIN, lambda head: head.records > 0)
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    assert head.signature
    assert verify(path, expected_head=head.head_sha256).intact
    kept = kept_head(tmp_path / "memory.sqlite", path.name).head
    assert kept == verify(path).head
    drive = MemoryStore(tmp_path / "memory.sqlite").recall("drive", path.name)
    assert [one.value["closed"] for one in drive] == [True, False]
    assert drive[0].value["head"] == kept


def test_health_tells_where_the_log_is_and_what_it_costs(tmp_path: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10))
        b.probe.publish(topics.EGO, Ego(speed_mps=1.0))
        b.wait_for(topics.HEALTH, lambda health: health.detail.get("log", "") != "", id="logger")
        assert Path(node.detail["log"]).is_file()
        assert {"log_lost", "log_mb_per_hour", "log_trouble"} <= node.detail.keys()


@pytest.mark.parametrize(("within_s", "most"), [(10.0, 40), (0.0, 1)])
def test_a_logger_that_is_behind_at_its_end_logs_the_rest_or_says_how_much_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, within_s: float, most: int
) -> None:
    monkeypatch.setattr(node_module, "FINISH_S", within_s)
    take, busy, ending, close = Recorder.take, threading.Event(), threading.Event(), Inbox.close

    def closed(inbox: Inbox) -> None:
        close(inbox)
        ending.set()

    def behind(recorder: Recorder, topic: Topic[Any], *rest: Any, **head: Any) -> None:
        if topic is topics.EGO and not busy.is_set():
            busy.set()
            ending.wait(10.0)  # by then the rest is sent, and nothing more is taken in
        take(recorder, topic, *rest, **head)

    monkeypatch.setattr(Recorder, "take", behind)
    monkeypatch.setattr(Inbox, "close", closed)
    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path)))
        for n in range(40):
            b.probe.publish(topics.EGO, Ego(speed_mps=float(n)))
        assert busy.wait(10.0)
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    assert verify(path).closed
    logged = [one for one in messages(path) if one.name in ("can/ego", "logger/gap")]
    found = [one for one in logged if one.name == "can/ego"]
    lost = sum(msgspec.json.decode(one.data)["lost"] for one in logged if one.name == "logger/gap")
    assert len(found) == most
    assert len(found) + lost >= 40


@pytest.mark.parametrize(
    "setting",
    [
        *("flush_ms=0", "flush_ms=-5", "flush_ms=NaN", 'flush_ms="nan"', "fsync_s=-1", "queue_mb=-1", "queue_mb=0"),
        *("max_file_mb=0", "max_file_s=0", "max_total_mb=-1", "max_age_days=-1", "max_age_days=Infinity"),
        *("pictures_before_s=-1", "pictures_after_s=NaN", "view.port=99999", "view.web_port=-1", "view.image_hz=-1"),
        "view.memory_mb=0",
    ],
)
def test_a_setting_out_of_its_bounds_is_refused_by_name(setting: str) -> None:
    with pytest.raises(ConfigError, match=setting.partition("=")[0].rsplit(".", 1)[-1]):
        load_config(LoggerConfig, None, [setting])


def test_an_unusable_memory_does_not_stop_the_log(tmp_path: Path) -> None:
    (tmp_path / "memory.sqlite").write_bytes(b"this is no database" * 100)
    with bus() as b:
        logged = _logged(b, tmp_path, [(topics.EGO, Ego(speed_mps=1.0), None)])
    assert [one.name for one in logged] == ["can/ego"]


@pytest.mark.parametrize("stamps", [[-1, 2**63 - 1], [2**64 - 1, -(2**63), 2**63]])
def test_a_publication_is_logged_whatever_its_stamp_and_the_next_one_too(stamps: list[int], tmp_path: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10))
        for stamp_ns in (*stamps, 42):
            b.probe.publish(topics.EGO, Ego(speed_mps=1.0), stamp_ns=stamp_ns)
        trace = msgspec.structs.replace(trace_of(7), stamp_ns=stamps[0])
        b.probe.publish(topics.TRACE, trace, stamp_ns=stamps[0])
        b.probe.publish(topics.EGO, Ego(speed_mps=2.0), stamp_ns=42)
        b.wait_for(topics.CHAIN, lambda head: head.records >= len(stamps) + 3)
        found = b.call("find_traces", {}).result
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    assert verify(path).closed
    written = [min(max(stamp_ns, 0), 2**63 - 1) for stamp_ns in stamps]
    assert [one.stamp_ns for one in messages(path) if one.name == "can/ego"] == [*written, 42, 42]
    assert [one.data for one in messages(path) if one.name == "trace"] == [msgspec.json.encode(trace)]
    assert found is not None
    assert [row["tick"] for row in found["traces"]] == [7]


@pytest.mark.parametrize("topic", LOGGED, ids=lambda topic: topic.name)
def test_every_logged_topic_has_a_sound_schema(topic: Topic[msgspec.Struct]) -> None:
    schema = msgspec.json.decode(json_form(topic.message).schema)
    Draft202012Validator.check_schema(schema)
    assert schema["type"] == "object"


def test_a_log_line_is_a_foxglove_log(tmp_path: Path) -> None:
    from foxglove_schemas_protobuf.Log_pb2 import Log

    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10))
        line = ServiceLog(service="rules", level="warning", message="no pack", fields={"pack": "X"})
        b.probe.publish(topics.LOG, line, id="rules")
        b.wait_for(topics.CHAIN, lambda head: head.records > 0)
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    (data,) = [one.data for one in messages(path) if one.name == "log/rules"]
    log = Log.FromString(data)
    assert (log.level, log.name, log.message) == (Log.WARNING, "rules", "no pack pack=X")


def test_the_signing_key_lies_outside_the_drives_folder_and_is_trusted_here(tmp_path: Path, own_state: Path) -> None:
    with bus() as b:
        _logged(b, tmp_path / "one", [(topics.EGO, Ego(speed_mps=1.0), None)])
    with bus() as b:
        _logged(b, tmp_path / "two", [(topics.EGO, Ego(speed_mps=1.0), None)])
    keys = []
    for name in ("one", "two"):
        (path,) = log_folder.logs(tmp_path / name / "logs")
        origin = verify(path).origin
        assert origin is not None
        keys.append(origin.public_key)
    assert not [path for path in tmp_path.rglob("*") if path.name.startswith("log-key")]
    private = own_state / "drivemcp" / "log-keys" / "log-key.pem"
    assert private.stat().st_mode & 0o777 == 0o600
    assert keys[0] == keys[1] == private.with_name("log-key.pub").read_text().strip()
    assert trust.judge(trust.read(trust.own_file()), "whichever", keys[0]).standing == "known"


def test_signed_heads_are_anchored_in_a_file_elsewhere(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere" / "heads"
    elsewhere.parent.mkdir()
    with bus() as b:
        node = b.start(
            SERVICE, LoggerConfig(out_dir=str(tmp_path / "drive"), flush_ms=10, anchor_file=str(elsewhere), anchor_s=0)
        )
        b.probe.publish(topics.EGO, Ego(speed_mps=1.0))
        b.wait_for(topics.CHAIN, lambda head: head.records > 0)
        node.close()
    (path,) = log_folder.logs(tmp_path / "drive" / "logs")
    heads = anchor.read(elsewhere).heads[path.name]
    report = verify(path, anchored=heads)
    assert report.intact
    assert report.head in heads
    assert elsewhere.stat().st_mode & 0o777 == 0o640
    assert verify(path, anchored=heads | {"ab" * 32}).expected_head_missing


def test_heads_that_cannot_be_anchored_stand_in_the_health_and_cost_no_record(tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere" / "heads"
    with bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10, anchor_file=str(nowhere)))
        b.probe.publish(topics.EGO, Ego(speed_mps=1.0))
        health = b.wait_for(topics.HEALTH, lambda health: "anchor_trouble" in health.detail, id="logger")
        node.close()
    assert str(nowhere) in health.detail["anchor_trouble"]
    assert verify(*log_folder.logs(tmp_path / "logs")).closed


def test_a_private_log_keeps_what_was_told_and_hashes_the_rest(tmp_path: Path) -> None:
    spoken = trace_of(7)
    silent = replace(
        spoken, decision=replace(spoken.decision, kind="SILENT"), advisory=replace(spoken.advisory, kind="SILENT")
    )
    egos = [Ego(speed_mps=10.0625 + k) for k in range(30)]
    config = LoggerConfig(
        out_dir=str(tmp_path), secret_dir=str(tmp_path / "keys"), flush_ms=10, privacy="minimal",
        view=ViewSettings(mode="file"),
    )  # fmt: skip
    with bus() as b:
        node = b.start(SERVICE, config)
        for ego in egos:
            b.probe.publish(topics.EGO, ego, stamp_ns=42)
        for trace in (silent, spoken):
            b.probe.publish(topics.TRACE, trace, stamp_ns=42)
        b.wait_for(topics.CHAIN, lambda head: head.records > 0)
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    report, logged = verify(path), list(messages(path))
    assert report.closed
    assert report.intact
    assert [one.data for one in logged if one.name == "trace"] == [msgspec.json.encode(spoken)]
    assert not [one for one in logged if one.name in ("can/ego", "advisory")]
    assert not list(tmp_path.glob("*.rrd"))
    told = {w.topic: w for one in logged if one.name == TOPIC for w in [msgspec.json.decode(one.data, type=Withheld)]}
    assert {topic: each.count for topic, each in told.items()} == {"can/ego": len(egos), "trace": 1}
    expected = hmac.new(signing.load_or_make(tmp_path / "keys").withholding_key(), digestmod="sha256")
    for ego in egos:
        data = msgspec.json.encode(ego)
        expected.update(len(data).to_bytes(8, "little") + data)
    assert told["can/ego"].hmac_sha256 == expected.hexdigest()
    assert "16.0625" not in path.read_bytes().decode("latin-1")
