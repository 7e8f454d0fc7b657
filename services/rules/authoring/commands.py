"""`drivemcp rulepack new|validate|hash|seal|sign|diff|test|show|import`."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.files.packfiles import folder_of
from drivemcp.terminal import own_terminal
from services.rules.authoring import cases, diff, diff_page, scaffold, show, validate
from services.rules.authoring.seal import seal
from services.rules.authoring.statutes import drafts
from services.rules.errors import PackError
from services.rules.packs.files import SIGNATURE
from services.rules.packs.loading import content_hash, load
from services.rules.packs.signature import Trust, sign

Run = Callable[[argparse.Namespace], int]
_FOLDER = "a pack's folder, or the name of one that is installed"


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp rulepack`."""
    parser = subparsers.add_parser(
        "rulepack",
        help="write, check, sign and compare rulepacks",
        description="A rulepack is one country's traffic law as a folder of files (docs/how-to/rulepacks.md). "
        "Exit status: 0 well, 1 the pack is not right, 2 the command was not.",
    )
    kinds = parser.add_subparsers(metavar="COMMAND", required=True)
    new = _command(kinds, "new", _new, "start a pack: a copy of TEST-v1 as drafts, or one that extends another")
    new.add_argument("folder", metavar="FOLDER", type=Path)
    new.add_argument("--jurisdiction", metavar="CODE", help="ISO 3166 alpha-3, for example ITA or USA-NV")
    new.add_argument("--title", default="")
    new.add_argument("--extends", metavar="ID", default="", help="the pack that this one adds to")
    check = _command(kinds, "validate", _validate, "say everything that is wrong, with file, line and field")
    _folders(check)
    check.add_argument("--key", metavar="PUBLIC", action="append", default=[], help="demand a signature by this key")
    _folders(_command(kinds, "hash", _hash, "print the content hash"))
    _folders(_command(kinds, "seal", _seal, "after an edit: find the texts' offsets again and write the content hash"))
    signing = _command(kinds, "sign", _sign, "sign a sealed pack (make a key: drivemcp grant --make-key FILE)")
    signing.add_argument("folder", metavar="FOLDER")
    signing.add_argument("--key", metavar="FILE", required=True, help="the private key")
    compare = _command(kinds, "diff", _diff, "say in words what changed for a driver")
    compare.add_argument("old", metavar="OLD")
    compare.add_argument("new", metavar="NEW")
    compare.add_argument("--html", metavar="FILE", type=Path, help="write a page of both side by side, for a lawyer")
    _folders(_command(kinds, "test", _test, "ask a pack's own cases"))
    shown = _command(kinds, "show", _show, "list a pack, or show one provision or sign in full")
    shown.add_argument("folder", metavar="FOLDER", help=_FOLDER)
    shown.add_argument("name", metavar="ID|CODE", nargs="?")

    taken = _command(kinds, "import", _import, "add a statute's XML to a pack as drafts")
    taken.add_argument("file", metavar="FILE", type=Path, help="gesetze-im-internet's XML, CLML, or Akoma Ntoso")
    taken.add_argument("--out", metavar="FOLDER", type=Path, required=True, help="the pack; a new folder is begun")
    taken.add_argument("--prefix", metavar="ID", default="", help="how the provisions' ids begin, for example gbr-rtra")
    taken.add_argument("--jurisdiction", metavar="CODE", default="", help="where the file does not say it")


def _command(kinds: Subparsers, name: str, run: Run, said: str) -> argparse.ArgumentParser:
    parser = kinds.add_parser(name, help=said, description=said[0].upper() + said[1:] + ".")
    parser.set_defaults(run=lambda flags: _guarded(run, flags))
    return parser


def _guarded(run: Run, flags: argparse.Namespace) -> int:
    """A pack that is not right is the author's to mend, not a wrong command."""
    try:
        return run(flags)
    except PackError as error:
        sys.stderr.write(f"{error}\n")
        return 1


def _at(name: str) -> Path:
    """A folder that is here comes before an installed pack of that name. Raises UserError where there is neither."""
    folder = Path(name) if Path(name).is_dir() else folder_of(name)
    if not folder.is_dir():
        raise UserError(f"no pack {name!r}: neither a folder that is here, nor the name of an installed one")
    return folder


def _folders(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folders", metavar="FOLDER", nargs="+", help=_FOLDER)


def _new(flags: argparse.Namespace) -> int:
    scaffold.scaffold(flags.folder, flags.jurisdiction, flags.title, flags.extends)
    drafts = "" if flags.extends else " of drafts, which no service loads"
    return _say(f"{flags.folder} is made{drafts}; edit it, then: drivemcp rulepack seal {flags.folder}")


def _validate(flags: argparse.Namespace) -> int:
    trust = Trust(keys=tuple(flags.key), required=bool(flags.key))
    wrong = 0
    for name in flags.folders:
        problems = validate.validated(_at(name), trust)
        wrong += len(problems)
        _say("\n".join(str(problem) for problem in problems) or f"{name}: right, {load(_at(name), trust).version}")
    if wrong:
        sys.stderr.write(f"{wrong} wrong\n")
    return int(wrong > 0)


def _hash(flags: argparse.Namespace) -> int:
    return _each(flags.folders, lambda name: content_hash(_at(name)))


def _seal(flags: argparse.Namespace) -> int:
    return _each(flags.folders, _sealed)


def _sealed(name: str) -> str:
    folder = _at(name)
    signed = (folder / SIGNATURE).is_file()
    found = seal(folder)
    if signed and not (folder / SIGNATURE).exists():
        _say(
            f"{folder / SIGNATURE} signed another content and is removed; sign anew: drivemcp rulepack sign {folder} --key FILE"
        )
    return found


def _import(flags: argparse.Namespace) -> int:
    statute = drafts.import_statute(flags.file, flags.out, flags.prefix, flags.jurisdiction)
    for told in statute.left:
        _say(told)
    return _say(
        f"{len(statute.sections)} drafts in {flags.out}; what each still needs: drivemcp rulepack validate {flags.out}"
    )


def _each(names: list[str], said: Callable[[str], str]) -> int:
    for name in names:
        found = said(name)
        _say(f"{found}  {name}" if len(names) > 1 else found)
    return 0


def _sign(flags: argparse.Namespace) -> int:
    try:
        private = Path(flags.key).read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"cannot read the key {flags.key}: {error}") from None
    made = sign(_at(flags.folder), private)
    return _say(f"{made.pack_id} {made.version} #{made.content_sha256[:12]} is signed by {made.public_key}")


def _diff(flags: argparse.Namespace) -> int:
    old, new = load(_at(flags.old)), load(_at(flags.new))
    if flags.html is not None:
        try:
            flags.html.write_text(diff_page.page(old, new), encoding="utf-8")
        except OSError as error:
            raise UserError(f"cannot write {flags.html}: {error.strerror}") from None
    found = diff.differences(old, new)
    for part in found:
        _say(f"{part.heading}\n" + "\n".join(f"  {line}" for line in part.lines))
    return _say("nothing changed") if not found else 0


def _test(flags: argparse.Namespace) -> int:
    failed = False
    for name in flags.folders:
        try:
            found = cases.tried(_at(name), _progress(name))
        except PackError as error:
            failed = True
            _say(str(error))
            continue
        failed = failed or found.failed > 0
        _say("\n".join([*found.lines, f"{found.pack}: {found.cases - found.failed} of {found.cases} cases hold"]))
    return int(failed)


def _progress(name: str) -> Callable[[int, int], None]:
    def show_progress(done: int, cases: int) -> None:
        if sys.stderr.isatty():
            own_terminal(sys.stderr).write(f"\r{name}: {done} of {cases}" + ("\r\033[K" if done == cases else ""))
            sys.stderr.flush()

    return show_progress


def _show(flags: argparse.Namespace) -> int:
    return _say(show.shown(load(_at(flags.folder)), flags.name))


def _say(text: str) -> int:
    sys.stdout.write(f"{text}\n")
    return 0
