"""A person behind a line at which the ego has to stop: the line is told, once, for both."""

from itertools import pairwise
from typing import Any

import pytest

from proto.perception import Track
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import Drive, Played, actor, fact

SPEED_MPS = 8.6


def approaching(
    line_m: float | None,
    person_m: float,
    light: float = 0.95,
    slows_mps2: float = 0.0,
    until_s: float = 3.0,
    light_when_told: float | None = None,
    light_from_s: float = 0.0,
) -> Drive:
    """On the way to a red light and a person who crosses, so far ahead at first."""
    drive = Drive(Played(arbiter=arbiter()), speed_mps=SPEED_MPS)
    drive.ticks(20)
    way_m, speed_mps = 0.0, SPEED_MPS
    for tick in range(round(until_s * 10)):
        told = any(each.advisory.kind != "SILENT" for _, _, each in drive.history[21:])
        seen = light if light_when_told is None or not told else light_when_told
        slows = slows_mps2 if told and tick > 8 else 0.0
        speed_mps -= slows / 10.0
        way_m += speed_mps / 10.0
        drive.comes_to(speed_mps)
        drive.acceleration_mps2 = -slows
        drive.tracks = (walker(person_m - way_m, speed_mps),)
        red = [] if line_m is None or tick < light_from_s * 10 else [
            fact("light", "light:red", track_id=4, distance_m=line_m - way_m + 2.25, confidence=seen)
        ]  # fmt: skip
        drive.tick(*red)
    return drive


def approached(line_m: float | None, person_m: float, light: float = 0.95, **how: Any) -> list[tuple[str, str]]:
    """What is spoken on that way, and how urgently."""
    said = (each.advisory for _, _, each in approaching(line_m, person_m, light, **how).history)
    return [(each.directive, each.urgency) for each in said if each.kind != "SILENT"]


def walker(gap_m: float, closing_mps: float) -> Track:
    return actor(gap_m, closing_mps, kind="pedestrian", length_m=0.5, x_m=gap_m + 2.5)


def test_of_a_person_behind_a_red_light_the_light_alone_is_told() -> None:
    assert approached(31.0, 35.0, slows_mps2=2.0, until_s=1.6) == [("Stop: red light", "warning")]


@pytest.mark.parametrize("flickers_to", [0.5, 0.95])
def test_a_light_that_was_told_stands_for_the_person_while_it_is_in_doubt(flickers_to: float) -> None:
    said = approached(31.0, 35.0, slows_mps2=2.0, until_s=1.6, light_when_told=flickers_to)
    assert said == [("Stop: red light", "warning")]


@pytest.mark.parametrize(
    ("line_m", "light"), [(None, 0.95), (44.0, 0.95), (31.0, 0.45)], ids=["no light", "behind the person", "doubted"]
)
def test_of_a_person_before_the_line_or_without_a_sure_one_the_person_is_told(
    line_m: float | None, light: float
) -> None:
    assert approached(line_m, 35.0, light, until_s=1.6)[0] == ("Person ahead", "warning")


@pytest.mark.parametrize("slows_mps2", [0.0, 2.4])
def test_a_line_that_is_seen_while_a_person_is_told_waits_for_the_end_of_these_words(slows_mps2: float) -> None:
    drive = approaching(33.0, 35.0, slows_mps2=slows_mps2, until_s=2.0, light_from_s=0.4)
    said = [(tick, each.advisory) for tick, (_, _, each) in enumerate(drive.history) if each.advisory.kind != "SILENT"]
    assert [each.directive for _, each in said] == ["Person ahead", "Stop: red light"]
    assert all(later - sooner >= 8 for (sooner, _), (later, _) in pairwise(said))


def test_a_line_that_needs_firm_braking_does_not_wait_for_the_end_of_other_words() -> None:
    drive = approaching(15.0, 35.0, until_s=1.0, light_from_s=0.4)
    said = [
        (tick, each.advisory.directive)
        for tick, (_, _, each) in enumerate(drive.history)
        if each.advisory.kind != "SILENT"
    ]
    assert [words for _, words in said] == ["Person ahead", "Stop: red light"]
    assert said[1][0] - said[0][0] < 8


def test_a_driver_who_does_not_stop_for_the_light_is_told_of_the_person_and_hears_the_alarm() -> None:
    said = approached(31.0, 35.0)
    assert said[0] == ("Stop: red light", "warning")
    assert ("Brake! Person", "alarm") in said
