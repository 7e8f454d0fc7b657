"""`python -m benchmarks [SECTION ...] [--out FILE]`: all of them unless named."""

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.calls import parallel, tool_call
from benchmarks.can import can
from benchmarks.diagnostics import diagnostics
from benchmarks.drive import stages
from benchmarks.figures import machine_now
from benchmarks.footprint import footprint
from benchmarks.gateway import gateway
from benchmarks.neighbours import neighbours
from benchmarks.peykan import peykan
from benchmarks.report import report
from benchmarks.subject import make_peers
from drivemcp.errors import UserError

SECTIONS: dict[str, Callable[[], str]] = {
    "call": tool_call,
    "parallel": parallel,
    "neighbours": neighbours,
    "gateway": gateway,
    "drive": stages,
    "can": can,
    "diagnostics": diagnostics,
    "peykan": peykan,
    "footprint": footprint,
}
NEED_PEERS = {"call", "parallel"}


def main() -> int:
    """Run, print, and write where asked; 1 where a section failed, 2 where the file cannot be written."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="which ones; all by default")
    parser.add_argument("--out", type=Path, help="also write the report here")
    flags = parser.parse_args()
    sections = {name: partial(_section, name) for name in flags.sections or SECTIONS}
    try:
        return report("python -m benchmarks", f"# Benchmarks\n\n`make bench`, {machine_now()}.", sections, flags.out)
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2


def _section(name: str) -> str:
    if name in NEED_PEERS:
        make_peers()
    return SECTIONS[name]()


if __name__ == "__main__":
    sys.exit(main())
