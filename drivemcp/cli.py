"""The console command. Subcommands are found through the entry-point group `drivemcp.commands`."""

import argparse
import os
import select
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import entry_points, version

from drivemcp.errors import BusError, DriveMcpError, UserError
from drivemcp.runtime.proto_guard import check_proto
from drivemcp.terminal import filter_output

GROUP = "drivemcp.commands"
EXIT_CODES = {
    0: "done",
    1: "the command failed, or found what it looks for: a broken log, a difference, a failed check",
    2: "a mistake of the user's, or a bus that cannot be reached; one line on stderr says what to do",
    130: "interrupted (Ctrl-C)",
}
_REMEDIES = {
    "evaluation": "the distribution drivemcp-evaluation: pip install --find-links FOLDER 'drivemcp[evaluation]', or make install",
    "studies": "a clone of the repository: make install",
}
"""By package that drivemcp's own wheel leaves out: how to come by it."""


def make_parser() -> argparse.ArgumentParser:
    """The parser with every subcommand that is installed."""
    parser = argparse.ArgumentParser(
        prog="drivemcp",
        description="A driver-assistance layer: typed world state, cited traffic law, RSS-based arbitration, a log that replays.",
        epilog="Research software; no certified safety system. Start with: drivemcp up",
    )
    parser.add_argument("--version", action="version", version=f"drivemcp {version('drivemcp')}")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            register = point.load()
        except ModuleNotFoundError as error:
            _register_absent(subparsers, point.name, error.name or "?")
        else:
            register(subparsers)
    return parser


def _register_absent(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]", name: str, module: str) -> None:
    parser = subparsers.add_parser(name, help=f"(not installed: needs {module})")
    parser.add_argument("rest", nargs="*")

    def refuse(_: argparse.Namespace) -> int:
        raise UserError(f"`drivemcp {name}` needs {_REMEDIES.get(module.partition('.')[0]) or _module_remedy(module)}")

    parser.set_defaults(run=refuse)


def _module_remedy(module: str) -> str:
    return f"the module {module!r}: pip install 'drivemcp[demo]', or make install"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command and exit with one of `EXIT_CODES`."""
    filter_output()
    sys.exit(run(arguments))


def run(arguments: Sequence[str] | None = None, check: Callable[[], None] = check_proto) -> int:
    """As `main`, returning the exit status; `check` is made before anything else."""
    try:
        check()
        flags = make_parser().parse_args(arguments)
        status: int = flags.run(flags)
        sys.stdout.flush()
    except (UserError, BusError) as error:
        sys.stderr.write(f"drivemcp: {error}\n")
        return 2
    except DriveMcpError as error:
        sys.stderr.write(f"drivemcp: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("drivemcp: interrupted\n")
        return 130
    except BrokenPipeError as error:
        if not _reader_is_gone():
            sys.stderr.write(f"drivemcp: a connection broke off: {error}\n")
            return 1
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return status


def _reader_is_gone() -> bool:
    """Whether the reader of the standard output has closed it, as after `| head`."""
    watch = select.poll()
    try:
        watch.register(sys.stdout, 0)
    except OSError:
        return False  # it is no file and cannot be closed
    return any(state & (select.POLLERR | select.POLLHUP) for _, state in watch.poll(0))


if __name__ == "__main__":
    main()
