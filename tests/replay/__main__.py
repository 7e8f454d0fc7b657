"""`make replay`: logs decided again and rendered drives driven again, compared with `lock.json`.

`--update` locks what today's code does; the difference of `lock.json` is in the review. `--logs` leaves the rendered drives
out. `--record NAME` drives the drive of a log anew, as a new kind of input needs.
"""

import argparse
import sys

from tests.replay.compare import complaints, decided, names, of_log, updated
from tests.replay.files import LOCK, read_lock, write_lock
from tests.replay.recordings import RECORDINGS, record


def main() -> int:
    """0: all as locked; 1: something differs; 2: there is nothing to compare with."""
    parser = argparse.ArgumentParser(prog="make replay ARGS=", description=__doc__)
    parser.add_argument("--update", action="store_true", help="lock what today's code does")
    parser.add_argument("--logs", action="store_true", help="logs alone, without the rendered drives")
    parser.add_argument("--record", metavar="NAME", nargs="+", choices=[*RECORDINGS, "all"], default=[])
    flags = parser.parse_args()
    for name in RECORDINGS if "all" in flags.record else flags.record:
        _say(f"driving {name}")
        record(name)
    lock = read_lock()
    if flags.update:
        write_lock(updated(lock, drives=not flags.logs))
        _say(f"locked: {LOCK}")
        return 0
    if not lock.logs:
        _say("nothing is locked: make replay ARGS=--update")
        return 2
    every = (of_log(name, lock, decided(name)) for name in names()) if flags.logs else complaints(lock)
    found = [complaint for complaint in every if complaint]
    _say("\n".join(found) or f"as locked: {len(lock.logs)} logs, {sum(map(len, lock.logs.values()))} ticks")
    return int(bool(found))


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
