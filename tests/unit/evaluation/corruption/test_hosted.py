"""A service is corrupted as it publishes, on a real bus; it is otherwise the same service, and truth passes as it is."""

from pathlib import Path

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from evaluation.corruption.hosted import hosted
from evaluation.corruption.logged import logged_records
from evaluation.corruption.record import CorruptionLog, read_records
from evaluation.corruption.spec import read_spec
from proto import topics
from proto.scene import Facts
from proto.sensors import CameraFrame, GnssFix
from proto.truth import Corrupted
from services.logger.service import SERVICE as LOGGER
from services.logger.service import LoggerConfig
from services.logger.writing.log_folder import logs
from tests.unit.evaluation.corruption.worlds import ORIGIN, SWEEP, TICK, frame, limit, post, said, truth


def drivelm(config: ServiceConfig, node: Node) -> None:
    """Reads a limit of 80 off each picture, and a light."""
    facts = Facts(facts=(limit(), said("light", "light:red")))
    node.subscribe(topics.CAMERA, lambda *_: node.publish(topics.FACTS, facts, stamp_ns=ORIGIN))

    @node.tool(deadline_ms=100)
    def describe_scene() -> str:
        """Say something."""
        return "a road"


def simulator(config: ServiceConfig, node: Node) -> None:
    """Publishes ten steps once it is asked to."""

    @node.tool(deadline_ms=1000)
    def start_scenario() -> int:
        """Drive."""
        for number in range(10):
            at_ns = ORIGIN + number * TICK
            node.publish(topics.TRUTH, truth(number / 10), stamp_ns=at_ns)
            node.publish(topics.LIDAR, SWEEP, id="top", stamp_ns=at_ns)
            node.publish(topics.CAMERA, frame(number), id="front", stamp_ns=at_ns)
            node.publish(topics.GNSS, fix_of(number))
        return 10


def fix_of(number: int) -> GnssFix:
    return GnssFix(x_m=float(number), y_m=0.0, heading_rad=0.0, sigma_m=1.0)


def ask_for_facts(b: TestBus, spec: str) -> tuple[Facts, list[Corrupted]]:
    """What the front end says of a sign that truth knows, and what is told of it."""
    node = b.start(hosted(Service("drivelm", ServiceConfig, drivelm), read_spec(spec)))
    told, known = b.collect(topics.CORRUPTED), b.collect(topics.TRUTH)

    def show() -> None:
        world = b.node("simulator")
        world.publish(topics.TRUTH, truth(signs=(post(5, 60.0),)), stamp_ns=ORIGIN)
        known.wait()
        world.publish(topics.CAMERA, CameraFrame(jpeg=b"x", width_px=1, height_px=1), id="front")

    facts = b.wait_for(topics.FACTS, after=show)
    assert node.detail["corruption"] == read_spec(spec).text()
    return facts, told.wait_count(1)


def test_a_missed_sign_is_not_published_and_told_of_and_the_light_is() -> None:
    with bus() as b:
        facts, told = ask_for_facts(b, "sign_miss=1")
        assert [fact.kind for fact in facts.facts] == ["light"]
        assert (told[0].kind, told[0].subject, told[0].hit) == ("sign_miss", "sign/5", True)
        assert b.call("describe_scene").ok


def test_what_was_done_to_which_track_stands_in_the_log(tmp_path: Path) -> None:
    with bus() as b:
        logger = b.start(LOGGER, LoggerConfig(out_dir=str(tmp_path), flush_ms=10))
        _, told = ask_for_facts(b, "sign_miss=1")
        b.wait_for(topics.CHAIN, lambda head: head.records > 3)
        logger.close()
    (log,) = logs(tmp_path / "logs")
    assert logged_records(log) == tuple(told)
    assert (told[0].subject, told[0].camera, told[0].track_id) == ("sign/5", limit().camera, limit().track_id)


def test_a_misread_sign_is_published_as_another() -> None:
    with bus() as b:
        facts, told = ask_for_facts(b, "limit_misread=1,misread_unit=0")
        assert facts.facts[0].reading == told[0].after.split()[0] != "limit:80"


def test_lost_sweeps_are_no_gap_and_truth_and_positions_pass() -> None:
    with bus() as b:
        b.start(hosted(Service("simulator", ServiceConfig, simulator), read_spec("lidar_loss=1,jitter_ms=50")))
        sweeps, truths, fixes = b.collect(topics.LIDAR, id="top"), b.collect(topics.TRUTH), b.collect(topics.GNSS)
        told = b.collect(topics.CORRUPTED)
        assert b.call("start_scenario").ok
        fixes.wait_count(10)
        assert truths.wait_count(10) == [truth(number / 10) for number in range(10)]
        assert [info.stamp_ns for info in truths.infos] == [ORIGIN + number * TICK for number in range(10)]
        assert sweeps.messages == []
        assert told.wait_count(1)[0].kind == "lidar_loss"


def test_a_clean_spec_publishes_what_the_service_does() -> None:
    with bus() as b:
        b.start(hosted(Service("simulator", ServiceConfig, simulator), read_spec("clean")))
        pictures = b.collect(topics.CAMERA, id="front")
        assert b.call("start_scenario").ok
        assert pictures.wait_count(10) == [frame(number) for number in range(10)]
        assert [info.stamp_ns for info in pictures.infos] == [ORIGIN + number * TICK for number in range(10)]


def test_what_is_told_is_kept_in_the_drives_folder_and_counted(tmp_path: Path) -> None:
    log = CorruptionLog(tmp_path)
    records = tuple(Corrupted(kind="sign_miss", subject=f"sign/{n}", stamp_ns=n, hit=n == 1) for n in range(3))
    for record in records:
        log.add(record)
    assert read_records(tmp_path) == records
    assert "sign_miss 1 of 3" in log.line()
    assert read_records(tmp_path / "none") == ()
