"""`python -m evaluation.evaluate.redecided FILE --runs FOLDER`: decide the logs of published runs of other code again, by today's.

Where nothing but the orchestrator or the arbiter was changed, a run of which every tick is decided alike is the one that today's code
would drive: the same words at the same ticks, hence the same road. One that is decided otherwise counts for nothing, and is driven
anew. FILE keeps which is which. Of a change elsewhere a log shows nothing; for that runs are drawn and driven (`alike.py`).
"""

import argparse
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from app.drive.screen import Screen, time_left
from app.replay.again import decide_again
from app.replay.log import traces
from drivemcp.errors import UserError
from drivemcp.numbers import whole
from evaluation.evaluate import published
from evaluation.evaluate.published import Line, Redecided
from evaluation.evaluate.store import LOG
from evaluation.recorded import fault_of


def redecided(log: Path) -> Redecided:
    """What today's code makes of a drive's log; "": it is not as it was written, or not all of it can be decided again."""
    if fault_of(log):
        return ""
    try:
        found = Counter(one.status for one in decide_again(traces([log])))
    except UserError:
        return ""
    if found["different"]:
        return "otherwise"
    return "alike" if found["identical"] and not found["undecidable"] else ""


def each(logs: Mapping[Path, Line], jobs: int) -> Iterator[tuple[Line, Redecided]]:
    """Whose log says what, as they end; `jobs` side by side."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=spawn) as pool:
        running = {pool.submit(redecided, log): line for log, line in logs.items()}
        try:
            for ended in as_completed(running):
                yield running[ended], ended.result()
        finally:
            pool.shutdown(cancel_futures=True)


def main() -> int:
    """Decide again, mark, tell; 2 where there is nothing to decide."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.evaluate.redecided", description=__doc__)
    parser.add_argument("file", type=Path, metavar="FILE", help="published runs")
    parser.add_argument("--runs", type=Path, default=Path("out/evaluate/runs"), help="the folder that keeps their logs")
    parser.add_argument("--jobs", type=whole(1, 1000), default=os.cpu_count() or 1, help="logs side by side")
    flags = parser.parse_args()
    try:
        return mark(flags.file, flags.runs, flags.jobs)
    except UserError as error:
        sys.stderr.write(f"drivemcp: {error}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("drivemcp: interrupted; what was decided again is in the file, and the same command goes on\n")
        return 130


def mark(file: Path, runs: Path, jobs: int) -> int:
    """Decide a file's runs of other code again, but for those that today's code decided before, and keep in it what came of it.

    What is done when it is interrupted is kept. Raises UserError where no log of any is there.
    """
    screen = Screen()
    others = [line for line in published.read(file).values() if not line.of_today]
    left = {log: line for line in others if not line.redecided_today and (log := runs / line.key / LOG).exists()}
    if not left and not any(line.redecided_today for line in others):
        raise UserError(f"{runs}: no log of a run of other code in {file}")
    made: dict[str, Redecided] = {}
    began_s = time.monotonic()
    try:
        for count, (line, found) in enumerate(each(left, jobs), 1):
            made[line.key] = found
            screen.live(f"{count} of {len(left)} logs; {time_left(count, len(left), began_s)}")
    finally:
        screen.end_live()
        lines = published.mark(file, made)
    sys.stdout.write(told([lines.get(line.key, line) for line in others]) + "\n")
    return 0


def told(others: Sequence[Line]) -> str:
    """How many runs of other code came out how."""
    found = Counter(line.redecided if line.redecided_today else "no log" for line in others)
    odd = sorted(line.key for line in others if line.refuted)
    return (
        f"{len(others)} runs of other code: {found['alike']} decided again alike, {found['otherwise']} otherwise"
        f"{' (' + ', '.join(odd) + ')' if odd else ''}, {found['']} not decidable, {found['no log']} without a log here"
    )


if __name__ == "__main__":
    raise SystemExit(main())
