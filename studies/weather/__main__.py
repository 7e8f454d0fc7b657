"""`python -m studies weather`: the simulator's true friction against the interval that Weather publishes, per
weather and per set of sources.

Seeds 1 to 30 were used to choose numbers; what is reported is measured with others.
"""

import argparse
import itertools
import sys

from drivemcp.paths import data
from services.simulator.environment.weather import WeatherCourse
from studies.output import Cell, Sheet, add_json, percent, show
from studies.weather.measure import WANTED_GAP, WANTED_INSIDE, Figures, Sample, drive, figures, weather_of
from studies.weather.sources import SOURCES
from studies.weather.weathers import GENERATED, shipped

TEST_SEEDS = range(2001, 2021)


def main() -> int:
    """Measure and print; 1 where all sources together miss a goal."""
    flags = _parser().parse_args()
    seeds = _seeds(flags.seeds)
    measured = _measured(flags.weather, flags.sources or list(SOURCES), seeds)
    told = {source: _summed(by_weather) for source, by_weather in measured.items()}
    goals = f"goals: inside at least {WANTED_INSIDE:.0%}, median gap at most {WANTED_GAP:.2f}"
    show([Sheet((), (), title=goals), *itertools.starmap(_sheet, told.items())], as_json=flags.json)
    return 0 if "all" not in told or told["all"]["together"].reached else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies weather", description=__doc__)
    parser.add_argument("--seeds", default=f"{TEST_SEEDS.start}-{TEST_SEEDS.stop - 1}", help="a range such as 1-40")
    known = [*(path.stem for path in sorted(data("scenarios").glob("*.toml"))), *GENERATED]
    parser.add_argument("--weather", nargs="+", choices=known)
    parser.add_argument("--sources", nargs="+", choices=list(SOURCES))
    add_json(parser)
    return parser


def _seeds(text: str) -> range:
    first, _, last = text.partition("-")
    try:
        seeds = range(int(first), int(last or first) + 1)
    except ValueError:
        seeds = range(0)
    if not seeds:
        raise SystemExit(f"--seeds: {text!r} is no range such as 1-40")
    return seeds


def _measured(names: list[str] | None, sources: list[str], seeds: range) -> dict[str, dict[str, list[Sample]]]:
    """Samples by source and weather; each weather is made once for all sources."""
    files = shipped(data("scenarios"))
    weathers = names or [*files, *GENERATED]
    measured: dict[str, dict[str, list[Sample]]] = {source: {name: [] for name in weathers} for source in sources}
    for name, seed in itertools.product(weathers, seeds):
        course = WeatherCourse(weather_of(name, seed, files), seed)
        for source in sources:
            measured[source][name] += drive(course, seed, SOURCES[source])
    return measured


def _summed(by_weather: dict[str, list[Sample]]) -> dict[str, Figures]:
    together = [sample for samples in by_weather.values() for sample in samples]
    return {**{name: figures(samples) for name, samples in by_weather.items()}, "together": figures(together)}


COLUMNS = (
    percent("inside"), percent("below low"), "by at most", "median gap", "p90 gap", "speed factor", "goals",
)  # fmt: skip


def _sheet(source: str, rows: dict[str, Figures]) -> Sheet:
    return Sheet((source, *COLUMNS), [_row(name, each) for name, each in rows.items()])


def _row(name: str, told: Figures) -> tuple[Cell, ...]:
    goals = "reached" if told.reached else "missed"
    return name, told.inside, told.over, told.worst_over, told.gap, told.gap_p90, told.speed_factor, goals


if __name__ == "__main__":
    sys.exit(main())
