"""`drivemcp completion SHELL`: the script that lets a shell complete commands, flags and files."""

import argparse
import sys
from collections.abc import Iterator

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError

SHELLS = ("bash", "zsh", "tcsh")
_FILES = ("FILE", "FOLDER", "DRIVE", "PACK", "OLD", "NEW", "HEX|FILE", "KEY|FILE", "NAME|FILE", "NAME|FOLDER")
"""Metavariables that stand for a path."""


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "completion",
        help="print the script that completes commands in a shell",
        description="Bash: drivemcp completion bash > ~/.local/share/bash-completion/completions/drivemcp. "
        "Zsh: drivemcp completion zsh > a file _drivemcp in a folder of $fpath.",
    )
    parser.add_argument("shell", choices=SHELLS)

    def command(flags: argparse.Namespace) -> int:
        whole = argparse.ArgumentParser(prog="drivemcp")
        whole._add_action(subparsers)
        sys.stdout.write(script(whole, flags.shell) + "\n")
        return 0

    parser.set_defaults(run=command)


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script of one of `SHELLS` for a parser. Raises UserError without shtab."""
    try:
        import shtab
    except ModuleNotFoundError:
        raise UserError("completion needs shtab: pip install 'drivemcp[completion]'") from None
    for action in _actions(parser):
        if action.choices is None and action.metavar in _FILES:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    return shtab.complete(parser, shell=shell)


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from _actions(below)
        else:
            yield action
