"""What the evaluation of Weather measures."""

import subprocess
import sys

import pytest

from drivemcp.paths import data
from services.simulator.environment.weather import WeatherCourse
from studies.weather.measure import Sample, drive, figures, weather_of
from studies.weather.sources import SOURCES
from studies.weather.weathers import GENERATED, shipped


def samples(weather: str, sources: str, seeds: range = range(1, 4)) -> list[Sample]:
    courses = [(WeatherCourse(weather_of(weather, seed, {}), seed), seed) for seed in seeds]
    return [sample for course, seed in courses for sample in drive(course, seed, SOURCES[sources])]


def test_figures_count_what_is_inside_and_how_far_below_the_truth_the_low_end_lies() -> None:
    told = figures([Sample(0.8, 0.7, 0.9, 1.0), Sample(0.5, 0.6, 0.9, 0.8), Sample(0.9, 0.6, 0.8, 1.0)])
    assert told.inside == pytest.approx(1 / 3)
    assert told.over == pytest.approx(1 / 3)
    assert told.worst_over == pytest.approx(0.1)
    assert told.gap == pytest.approx(0.1)
    assert not told.reached


def test_one_seed_gives_one_truth_whatever_the_sources() -> None:
    truths = [[sample.mu for sample in samples("rain", sources)] for sources in ("all", "car only", "nothing")]
    assert truths[0] == truths[1] == truths[2]


@pytest.mark.parametrize("weather", ["dry", "rain", "black ice"])
def test_with_all_sources_the_truth_lies_within_in_ordinary_and_in_dangerous_weather(weather: str) -> None:
    assert figures(samples(weather, "all")).inside >= 0.9


def test_with_fewer_sources_the_low_end_lies_lower() -> None:
    full, car, nothing = (figures(samples("dry", sources)).gap for sources in ("all", "car only", "nothing"))
    assert full < car < nothing


def test_every_shipped_scenario_and_every_generated_weather_is_measured() -> None:
    files = shipped(data("scenarios"))
    assert {"urb-rain", "dynamic-vsl", "cross-border"} <= set(files)
    for name in (*files, *GENERATED):
        assert weather_of(name, 7, files)


def test_the_command_prints_a_row_per_weather_and_refuses_no_seeds() -> None:
    command = [sys.executable, "-m", "studies.weather", "--weather", "dry", "--sources", "all", "--seeds"]
    done = subprocess.run([*command, "5"], capture_output=True, text=True, timeout=120)
    assert "| dry |" in done.stdout
    refused = subprocess.run([*command, "5-1"], capture_output=True, text=True, timeout=120)
    assert refused.returncode != 0
    assert "--seeds: '5-1' is no range" in refused.stderr
