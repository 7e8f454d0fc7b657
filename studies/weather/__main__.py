"""`python -m studies weather`: the simulator's true friction against the interval that Weather publishes, per
weather and per set of sources.

Seeds 1 to 30 were used to choose numbers; what is reported is measured with others.
"""

import argparse
import itertools
import sys

import msgspec

from drivemcp.paths import data
from services.simulator.environment.weather import WeatherCourse
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
    if flags.json:
        sys.stdout.write(msgspec.json.format(msgspec.json.encode(_plain(told))).decode() + "\n")
    else:
        sys.stdout.write("\n".join(_table(told)) + "\n")
    return 0 if "all" not in told or told["all"]["together"].reached else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies weather", description=__doc__)
    parser.add_argument("--seeds", default=f"{TEST_SEEDS.start}-{TEST_SEEDS.stop - 1}", help="a range such as 1-40")
    known = [*(path.stem for path in sorted(data("scenarios").glob("*.toml"))), *GENERATED]
    parser.add_argument("--weather", nargs="+", choices=known)
    parser.add_argument("--sources", nargs="+", choices=list(SOURCES))
    parser.add_argument("--json", action="store_true")
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


def _plain(told: dict[str, dict[str, Figures]]) -> dict[str, dict[str, dict[str, float]]]:
    return {source: {name: each._asdict() for name, each in rows.items()} for source, rows in told.items()}


def _table(told: dict[str, dict[str, Figures]]) -> list[str]:
    lines = [f"goals: inside at least {WANTED_INSIDE:.0%}, median gap at most {WANTED_GAP:.2f}", ""]
    for source, rows in told.items():
        lines += [f"| {source} | inside | below low | by at most | median gap | p90 gap | speed factor | goals |"]
        lines += ["|---|---|---|---|---|---|---|---|"]
        lines += [_row(name, each) for name, each in rows.items()]
        lines.append("")
    return lines


def _row(name: str, told: Figures) -> str:
    return (
        f"| {name} | {told.inside:.1%} | {told.over:.1%} | {told.worst_over:.2f} | {told.gap:.2f} | {told.gap_p90:.2f}"
        f" | {told.speed_factor:.2f} | {'reached' if told.reached else 'missed'} |"
    )


if __name__ == "__main__":
    sys.exit(main())
