"""`python -m benchmarks [call|parallel|neighbours|drive|can|diagnostics|footprint ...] [--out FILE]`: all of them unless named."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks.calls import parallel, tool_call
from benchmarks.can import can
from benchmarks.diagnostics import diagnostics
from benchmarks.drive import stages
from benchmarks.figures import machine_now
from benchmarks.footprint import footprint
from benchmarks.neighbours import neighbours
from benchmarks.subject import make_peers

SECTIONS: dict[str, Callable[[], str]] = {
    "call": tool_call,
    "parallel": parallel,
    "neighbours": neighbours,
    "drive": stages,
    "can": can,
    "diagnostics": diagnostics,
    "footprint": footprint,
}
NEED_PEERS = {"call", "parallel"}


def main() -> int:
    """Run, print, and write where asked."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="which ones; all by default")
    parser.add_argument("--out", type=Path, help="also write the report here")
    flags = parser.parse_args()
    chosen = flags.sections or list(SECTIONS)
    if NEED_PEERS & set(chosen):
        make_peers()
    parts = [f"# Benchmarks\n\n`make bench`, {machine_now()}."]
    for name in chosen:
        sys.stderr.write(f"{name}:\n")
        parts.append(SECTIONS[name]())
    report = "\n\n".join(parts) + "\n"
    sys.stdout.write(report)
    if flags.out:
        flags.out.write_text(report, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
