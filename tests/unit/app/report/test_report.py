"""The report of a drive: what it holds, and that it shows the words of a log as words."""

import base64
import re
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from hypothesis import given
from hypothesis import strategies as st

from app.pictures import jpeg_of, unpacked
from app.replay.again import AtHand
from app.report.drive_log import DriveLog, Spoken, read_drive
from app.report.page import page
from app.report.story import flip_in_words
from app.report.ticks import Advisory, Inputs, Limit, Tick, Told
from app.report.timeline import HEIGHT, WIDTH, timeline
from drivemcp.cli import run
from drivemcp.pictures import Image, draw_boxes
from proto.decision import TraceRecord
from proto.health import ServiceHealth
from proto.perception import Box, Boxes
from services.arbiter.explain import Flip
from services.logger.writing.log_file import Record
from services.logger.writing.topic_formats import json_form, protobuf_form
from tests.unit.app.replay.drive import drive, write_log

replace = msgspec.structs.replace


@pytest.fixture(scope="module")
def recorded() -> list[TraceRecord]:
    return drive(130)


def record(topic: str, message: msgspec.Struct, stamp_ns: int) -> Record:
    return Record(
        topic=topic, form=json_form(type(message)), sequence=1, log_time_ns=stamp_ns, publish_time_ns=stamp_ns,
        data=msgspec.json.encode(message),
    )  # fmt: skip


def picture(stamp_ns: int) -> Record:
    jpeg = cv2.imencode(".jpg", np.full((360, 640, 3), 90, np.uint8))[1].tobytes()
    return Record(
        topic="sensor/camera/front", form=protobuf_form(CompressedImage), sequence=1, log_time_ns=stamp_ns,
        publish_time_ns=stamp_ns, data=CompressedImage(data=jpeg, format="jpeg").SerializeToString(),
    )  # fmt: skip


HEALTH = ServiceHealth(service="rules", pid=1, uptime_s=3.0, rss_mb=31.0, detail={"settings": '{"pack":"mine"}'})


@pytest.fixture(scope="module")
def folder(recorded: list[TraceRecord], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive as its folder."""
    path = tmp_path_factory.mktemp("drive")
    (path / "logs").mkdir()
    first = next(each for each in recorded if each.advisory.kind != "SILENT").advisory.snapshot_stamp_ns
    box = Box(x0_px=10.0, y0_px=200.0, x1_px=60.0, y1_px=240.0, kind="vehicle", score=0.9, track_id=3, range_m=21.0)
    boxes = Boxes(camera="front", frame=1, boxes=(box,))
    before = [picture(first), record("perception/boxes", boxes, first), record("health/rules", HEALTH, first)]
    write_log(path / "logs" / "a.mcap", recorded, path / "secrets", before)
    return path


def test_the_command_writes_the_page_beside_the_logs_and_says_where(
    folder: Path, recorded: list[TraceRecord], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["report", str(folder)]) == 0
    told = Path(capsys.readouterr().out.strip())
    assert told == folder / "report.html"
    assert told.stat().st_mode & 0o077 == 0o040
    html = told.read_text(encoding="utf-8")
    spoken = [each for each in recorded if each.advisory.kind != "SILENT"]
    assert spoken
    for each in spoken:
        assert f'id="tick-{each.tick}"' in html
        assert all(cited.excerpt[:40] in html for cited in each.fused.citations if "'" not in cited.excerpt[:40])
    assert "The log is as it was written" in html
    assert "{&#34;pack&#34;:&#34;mine&#34;}" in html
    assert f"--tick {spoken[0].tick}" in html


@pytest.mark.parametrize(
    ("stamp_ns", "title"),
    [
        (1_785_000_000_000_000_000, "Drive of 2026-07-25 17:20:00 UTC"),
        (300_000_000, "Drive in simulated time"),
    ],
)
def test_the_title_has_the_date_that_the_log_has(stamp_ns: int, title: str) -> None:
    once = msgspec.convert({"tick": 1, "stamp_ns": stamp_ns, "advisory": {}}, Tick)
    html = page(DriveLog((), ticks=[once]), AtHand())
    assert f"<h1>{title}</h1>" in html


def test_the_page_asks_no_host_and_runs_no_script(folder: Path) -> None:
    html = page(read_drive([folder / "logs" / "a.mcap"]), AtHand())
    assert not re.findall(r"(?:src|href)=\"(?!data:image/jpeg;base64,|#)", html)
    assert "<script" not in html
    assert "url(" not in html


def test_a_message_shows_the_picture_that_was_decided_on_with_its_boxes(folder: Path) -> None:
    html = page(read_drive([folder / "logs" / "a.mcap"]), AtHand())
    shown = re.findall(r"data:image/jpeg;base64,([^\"]+)", html)
    assert shown
    pixels = unpacked(base64.b64decode(shown[0]))
    assert pixels is not None
    assert pixels.shape == (360, 640, 3)
    assert pixels[196:244, 6:64].std() > pixels[260:, 100:].std() + 5.0


def test_words_of_the_world_are_shown_as_words(recorded: list[TraceRecord], tmp_path: Path) -> None:
    hostile = '</q><script>alert(1)</script><img src="http://x/y">{{ 7 * 7 }}'
    said = next(each for each in recorded if each.advisory.kind != "SILENT")
    advisory = replace(
        said.advisory, directive=hostile, justification=hostile, degraded=(hostile,), late_tools=(hostile,)
    )
    decision = replace(said.decision, reason=hostile, act_withheld=hostile)
    write_log(
        tmp_path / "a.mcap",
        [replace(said, advisory=advisory, decision=decision, versions={hostile: hostile})],
        tmp_path / "s",
    )
    html = page(read_drive([tmp_path / "a.mcap"]), AtHand())
    assert "<script" not in html
    assert '<img src="http' not in html
    assert "49" not in re.findall(r"<h3>.*?</h3>", html)[0]


def test_a_log_that_was_changed_is_said_to_be(folder: Path, tmp_path: Path) -> None:
    raw = bytearray((folder / "logs" / "a.mcap").read_bytes())
    raw[len(raw) // 2] ^= 1
    (tmp_path / "a.mcap").write_bytes(raw)
    log = read_drive([tmp_path / "a.mcap"])
    assert "The log does NOT verify" in page(log, AtHand())


def test_a_trace_of_an_older_version_is_shown_as_far_as_it_goes() -> None:
    old = msgspec.json.encode({"tick": 7, "stamp_ns": 5, "advisory": {"kind": "SPEAK", "directive": "Slow down"}})
    tick = msgspec.json.decode(old, type=Tick)
    log = DriveLog(
        (Path("old.mcap"),), ticks=[tick, replace(tick, tick=8, stamp_ns=6)], spoken=[Spoken(tick=tick, trace=old)]
    )
    html = page(replace_files(log), AtHand())
    assert "Slow down" in html
    assert "this version reads no trace of that one" in html


def replace_files(log: DriveLog) -> DriveLog:
    """Without files, of which there are none to verify."""
    log.files = ()
    return log


def test_a_log_without_a_trace_is_a_mistake_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_log(tmp_path / "a.mcap", [], tmp_path / "s")
    assert run(["report", str(tmp_path / "a.mcap")]) == 2
    assert "holds no trace of a drive" in capsys.readouterr().err


def test_one_tick_is_decided_again_and_explained(
    folder: Path, recorded: list[TraceRecord], capsys: pytest.CaptureFixture[str]
) -> None:
    said = next(each for each in recorded if each.advisory.kind != "SILENT")
    assert run(["replay", str(folder), "--tick", str(said.tick)]) == 0
    told = capsys.readouterr().out
    assert f"tick {said.tick}: identical" in told
    assert said.advisory.directive in told
    assert f"{said.decision.kind}: {said.decision.reason}." in told
    assert run(["replay", str(folder), "--tick", "100000"]) == 2


def test_a_change_that_would_have_decided_otherwise_reads_as_a_sentence() -> None:
    flip = Flip(
        quantity="distance to the actor", unit="m", from_value=12.0, to_value=38.04, becomes="SILENT", share_of_span=0.2
    )
    assert flip_in_words(flip) == "above a distance to the actor of 38 m (12 m then) it would have stayed silent"


ticks = st.builds(
    lambda step, speed, limit, target, assumed, kind: (step, speed, limit, target, assumed, kind),
    st.integers(-(10**9), 20 * 10**9), st.none() | st.floats(), st.none() | st.floats(), st.none() | st.floats(), st.booleans(),
    st.sampled_from(["SILENT", "SPEAK", "ACT", "?"]),
)  # fmt: skip


@given(st.lists(ticks, max_size=40), st.sampled_from(["km/h", "mph", "furlongs"]))
def test_the_plot_stays_in_its_frame_whatever_a_log_holds(
    rows: list[tuple[int, float | None, float | None, float | None, bool, str]], unit: str
) -> None:
    now_ns, made = 0, []
    for number, (step, speed, limit, target, assumed, kind) in enumerate(rows):
        now_ns += max(step, 0)
        told = None if limit is None else Limit(value=limit, mps=limit, assumed=assumed)
        advisory = Advisory(kind=kind, target_mps=target, legal_limit=told, degraded=("x",) if assumed else ())
        made.append(Tick(tick=number, stamp_ns=now_ns, advisory=advisory, world={}, inputs=_ego(speed)))
    plot = timeline(made, unit)
    assert (plot is None) == (len(rows) < 2)
    if plot is None:
        return
    for line in plot.lines:
        assert "nan" not in line.path
        for command, x, y in re.findall(r"([ML])([-0-9.]+) ([-0-9.]+)", line.path):
            assert command
            assert 0.0 <= float(x) <= WIDTH
            assert 0.0 <= float(y) <= HEIGHT
    assert all(x >= 0.0 and x + wide <= WIDTH + 1.0 for x, wide in plot.degraded)
    words = sum(each.advisory.kind == "SPEAK" for each in made)
    assert words <= len(plot.marks) <= words + sum(each.advisory.kind == "ACT" for each in made)


def _ego(speed: float | None) -> Inputs:
    return Inputs(ego=Told(message={"speed_mps": speed}))


def test_labels_of_boxes_do_not_cover_each_other() -> None:
    def drawn(*at_px: float) -> Image:
        blank = np.zeros((120, 300, 3), np.uint8)
        found = tuple(
            Box(x0_px=x, y0_px=60.0, x1_px=x + 6.0, y1_px=66.0 + k, kind="pedestrian", score=0.9, range_m=20.0 + k)
            for k, x in enumerate(at_px)
        )
        draw_boxes(blank, Boxes(camera="front", frame=1, boxes=found))
        return blank

    apart, close = drawn(10.0, 200.0), drawn(10.0, 16.0)
    assert (apart[40:59] > 0).sum() > 1.5 * (close[40:59] > 0).sum(), "one label of two"


def test_what_is_no_picture_has_no_jpeg() -> None:
    assert jpeg_of(b"no picture") == b""
    assert unpacked(b"\xff\xd8\xff broken \xff\xd9") is None
