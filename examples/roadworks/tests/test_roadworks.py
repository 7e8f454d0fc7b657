"""The roadworks expert on a real in-process bus."""

from drivemcp_roadworks.advice import ZONE_M, Seen, advise, drive
from drivemcp_roadworks.service import SERVICE

from drivemcp.bus.session import wait_settled
from drivemcp.testing import bus
from proto import topics
from proto.scene import Fact, Facts

SIGN = Fact(kind="sign", reading="roadworks", confidence=0.9, frame_stamp_ns=0, track_id=1)


def test_a_roadworks_sign_lowers_and_widens_and_nothing_else_does() -> None:
    with bus() as b:
        b.start(SERVICE)
        calm = b.call("assess_roadworks")
        assert calm.result is not None
        assert calm.result["speed_factor"] == calm.result["headway_factor"] == 1.0
        drivelm = b.node("drivelm")
        drivelm.publish(topics.FACTS, Facts(facts=(SIGN,)))

        def careful() -> bool:
            result = b.call("assess_roadworks").result
            return result is not None and result["speed_factor"] < 1.0 < result["headway_factor"]

        assert wait_settled(careful, 5.0)


def test_the_zone_ends_after_its_length_and_never_while_the_speed_is_unknown() -> None:
    seen: Seen | None = Seen(confidence=0.9)
    assert drive(seen, None, 1000.0) == seen
    assert drive(seen, 10.0, ZONE_M / 10.0 + 1) is None
    assert advise(drive(seen, 10.0, 1.0)).speed_factor < 1.0
