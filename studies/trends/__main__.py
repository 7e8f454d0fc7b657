"""`python -m studies trends --sound 200 --leaks 60`."""

import argparse
import statistics

from evaluation.tables.columns import Column
from studies.output import Sheet, add_json, show
from studies.trends.drives import MINUTES, drive, in_time, leaking


def main() -> None:
    """Show both figures."""
    parser = argparse.ArgumentParser(description="Alarms in sound drives; leaks told before their lamp.")
    parser.add_argument("--sound", type=int, default=200)
    parser.add_argument("--leaks", type=int, default=60)
    add_json(parser)
    arguments = parser.parse_args()
    alarms = [seed for seed in range(arguments.sound) if drive(seed).trend is not None]
    ran = [(leak, outcome) for leak, outcome in leaking(arguments.leaks) if outcome.lamp_s is not None]
    told = [each for each in ran if in_time(*each)]
    leads = [((o.lamp_s or 0.0) - (o.told_s or 0.0)) / 60.0 for _, o in told]
    rows = [
        (f"sound drives of {MINUTES:.0f} min", arguments.sound),
        ("of them with an alarm", len(alarms)),
        ("leaks that reach the lamp", len(ran)),
        ("of them told before it", len(told)),
        ("minutes before the lamp, median", statistics.median(leads) if leads else None),
        ("minutes before the lamp, least", min(leads, default=None)),
    ]
    seeds = [f"seeds with an alarm: {', '.join(map(str, alarms))}"] if alarms else []
    show([Sheet(("", Column(title="found", places=1)), rows, seeds)], as_json=arguments.json)


if __name__ == "__main__":
    main()
