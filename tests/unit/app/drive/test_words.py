"""What `drivemcp up` prints of a drive."""

import pytest

from app.drive.summary import Percentiles, Summary, Tally
from app.drive.words import end_line, summary_lines
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


def driven(ticks: int, *, late_frames: int = 0, infractions: dict[str, int] | None = None) -> str:
    """The summary of a drive of 60 s."""
    nothing = Percentiles(p50=None, p99=None, count=0)
    summary = Summary(
        scenario="urb-rain", seed=1, seconds=60.0, distance_m=650.0, infractions=infractions, collisions=0, overspeed_pct=0.0, ticks=ticks,
        messages=0, silent_share=1.0, acts_done=0, acts_withheld=0, hazards=0, hazard_response_s=[], ttc_first_warning_s=None,
        advisory_latency_ms=nothing, sensor_to_advice_ms=nothing, deadline_misses={}, tool_calls={}, degraded_ticks=0,
        late_frames=late_frames, encoder="", detector="",
    )  # fmt: skip
    return "\n".join(summary_lines(summary))


def test_a_machine_that_does_not_follow_a_simulated_drive_is_told_with_what_to_do() -> None:
    told = driven(249, late_frames=750, infractions={"red_light": 1})
    assert "4.2 decisions a second in place of 10, so that warnings came late or not at all: --lockstep" in told
    assert "too slow" not in driven(590, late_frames=3, infractions={})
    assert "too slow" not in driven(600, infractions={}), "in lockstep no frame is late"
    assert "too slow" not in driven(120, late_frames=9), "a recording may be slow itself"
