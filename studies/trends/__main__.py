"""`python -m studies trends --sound 200 --leaks 60`."""

import argparse
import statistics
import sys

from studies.trends.drives import MINUTES, drive, in_time, leaking


def _say(line: str) -> None:
    sys.stdout.write(line.rstrip() + "\n")


def main() -> None:
    """Print both figures."""
    parser = argparse.ArgumentParser(description="Alarms in sound drives; leaks told before their lamp.")
    parser.add_argument("--sound", type=int, default=200)
    parser.add_argument("--leaks", type=int, default=60)
    arguments = parser.parse_args()
    alarms = [seed for seed in range(arguments.sound) if drive(seed).trend is not None]
    _say(f"sound drives of {MINUTES:.0f} min: {arguments.sound}, with an alarm: {len(alarms)} {alarms or ''}")
    ran = [(leak, outcome) for leak, outcome in leaking(arguments.leaks) if outcome.lamp_s is not None]
    told = [each for each in ran if in_time(*each)]
    leads = [((o.lamp_s or 0.0) - (o.told_s or 0.0)) / 60.0 for _, o in told]
    _say(f"leaks that reach the lamp: {len(ran)}, told before it: {len(told)}")
    if leads:
        _say(f"minutes before the lamp: median {statistics.median(leads):.1f}, least {min(leads):.1f}")


if __name__ == "__main__":
    main()
