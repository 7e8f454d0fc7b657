"""What `drivemcp up` prints of a drive."""

import pytest

from app.drive.summary import Tally
from app.drive.words import end_line
from proto.truth import ScenarioState


def over(time_s: float, duration_s: float, problem: str = "") -> Tally:
    tally = Tally()
    tally.add_scenario(
        ScenarioState(
            scenario="urb-rain",
            seed=1,
            time_s=time_s,
            duration_s=duration_s,
            running=False,
            finished=True,
            problem=problem,
        )
    )
    return tally


@pytest.mark.parametrize(
    ("tally", "keep", "told"),
    [
        (over(60.0, 60.0), False, "the drive is over"),
        (over(60.0, 60.0), True, "the drive is over; the stack stays up until Ctrl-C"),
        (over(346.2, 600.0), False, "the route is over after 346 s; 600 s were asked for"),
        (over(12.0, 60.0, "no OpenGL"), True, "the drive broke off: no OpenGL; the stack stays up until Ctrl-C"),
    ],
)
def test_the_end_of_a_drive_is_told_with_its_reason(tally: Tally, keep: bool, told: str) -> None:
    assert end_line(tally, keep=keep) == told
