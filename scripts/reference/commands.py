"""The command line, from its parsers."""

import argparse
from collections.abc import Iterator

from drivemcp.cli import EXIT_CODES, make_parser
from scripts.reference.markdown import page, table


def commands() -> str:
    """The page."""
    return page(
        "Command line",
        "`drivemcp COMMAND --help` prints the same.",
        "## Exit codes\n\n" + table(("code", "meaning"), [(str(number), what) for number, what in EXIT_CODES.items()]),
        *_below(make_parser()),
    )


def _below(parser: argparse.ArgumentParser, about: str = "") -> Iterator[str]:
    inner = [each for each in parser._actions if isinstance(each, argparse._SubParsersAction)]
    if not inner or parser.prog != "drivemcp":
        yield _command(parser, about)
    for action in inner:
        helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
        for name, below in action.choices.items():
            yield from _below(below, helps.get(name, ""))


def _command(parser: argparse.ArgumentParser, about: str) -> str:
    formatter = parser._get_formatter()
    rows = [
        (_name(action), _default(action), formatter._expand_help(action) if action.help else "")
        for action in parser._actions
        if action.help != argparse.SUPPRESS
        and not isinstance(action, argparse._HelpAction | argparse._SubParsersAction)
    ]
    said = parser.description or f"{about[:1].upper()}{about[1:]}."
    depth = "##" if parser.prog.count(" ") == 1 else "###"
    return "\n\n".join(
        [
            f"{depth} {parser.prog}",
            " ".join(said.split()),
            *([table(("argument", "default", "what it does"), rows)] if rows else []),
        ]
    )


def _name(action: argparse.Action) -> str:
    choices = "{" + ",".join(map(str, action.choices)) + "}" if action.choices else ""
    value = choices or (action.metavar if isinstance(action.metavar, str) else action.dest.upper())
    if not action.option_strings:
        return f"`{value}`"
    return f"`{', '.join(action.option_strings)}{'' if action.nargs == 0 else ' ' + value}`"


def _default(action: argparse.Action) -> str:
    if action.required:
        return "required"
    empty = action.default in (None, "", [], (), False, argparse.SUPPRESS)
    return "" if empty or action.nargs == 0 else f"`{action.default}`"
