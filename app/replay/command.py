"""`drivemcp replay FILE...`: every tick decided again from its log; with a supposition, what would have differed."""

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import msgspec

from app.audit import broken_links, gone_files, known_head
from app.replay.again import Again, AtHand, UnknownProfile, decide_again, side_by_side, traces
from app.replay.whatif import Change, Otherwise, otherwise
from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.paths import data, has_data
from proto.decision import TraceRecord
from services.arbiter.decide import Inputs
from services.arbiter.explain import explain
from services.logger.verification.verifier import verify
from services.logger.writing.log_folder import named
from services.rules.book import RuleBook, load_book

LISTED = 20


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp replay`."""
    parser = subparsers.add_parser(
        "replay",
        help="decide every tick of a log again",
        description="Decides every tick again from its log, on the same commit and platform bit for bit. "
        "Exit status: 0 all identical, 1 some differ (or the log is not as it was written), 2 it cannot be replayed. "
        "With a supposition it prints what would have differed, the road and the driver staying as they were, and exits 0 "
        "(1 where the log is not as it was written).",
    )
    parser.add_argument("files", metavar="FILE", nargs="+", help="the log files of a drive in order, or their folder")
    parser.add_argument("--delta", type=float, help="suppose another Delta (the margin that ACT takes)")
    parser.add_argument("--mu", type=float, help="suppose this friction, as the arbiter reads it")
    parser.add_argument(
        "--rulepack", metavar="NAME|FOLDER", action="append", default=[], help="suppose these rulepacks and no others"
    )
    parser.add_argument(
        "--against", metavar="FILE", action="append", default=[], help="compare with another drive's log, tick by tick"
    )
    add_profile(parser)
    parser.add_argument("--tick", type=int, help="this tick alone, with what would have changed its decision")
    parser.add_argument("--all", action="store_true", help=f"list every tick that differs, not the first {LISTED}")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of text")
    parser.set_defaults(run=command)


def add_profile(parser: argparse.ArgumentParser) -> None:
    """The flag for what `AtHand` takes."""
    parser.add_argument(
        "--profile",
        metavar="FILE",
        action="append",
        default=[],
        type=Path,
        help="a profile of the drive's that is not shipped",
    )


def command(flags: argparse.Namespace) -> int:
    """Replay, or suppose."""
    paths, others, at_hand = named(flags.files), named(flags.against), AtHand(flags.profile)
    change = _change(flags)
    if others and change != Change():
        raise UserError("--against compares two drives as they were; it takes no --mu, --delta or --rulepack")
    if others and flags.profile:
        raise UserError("--against decides nothing again; it takes no --profile")
    unsound = [*_unsound(paths, flags.files), *_unsound(others, flags.against)]
    for complaint in unsound:
        sys.stderr.write(f"drivemcp: {complaint}\n")
    if flags.tick is not None:
        return max(_one(traces(paths), flags.tick, at_hand), int(bool(unsound)))
    if change != Change():
        return max(_suppose(traces(paths), change, at_hand, flags), int(bool(unsound)))
    ticks = list(side_by_side(traces(paths), traces(others)) if others else decide_again(traces(paths), at_hand))
    counts = Counter[str](one.status for one in ticks)
    if not ticks:
        raise UserError("no traces in this log: nothing to decide again")
    if flags.json:
        _say(
            msgspec.json.encode(
                {"ticks": len(ticks), **counts, "log_intact": not unsound, "differing": _differing(ticks)}
            ).decode()
        )
    else:
        _tell(ticks, counts, everything=flags.all)
    return int(counts["different"] > 0 or counts["identical"] == 0 or bool(unsound))


def _one(log: Iterable[TraceRecord], number: int, at_hand: AtHand) -> int:
    """One tick decided again, and explained."""
    kept: list[TraceRecord] = []

    def passed() -> Iterator[TraceRecord]:
        for trace in log:
            kept[:] = [trace]
            yield trace

    for again in decide_again(passed(), at_hand):
        if again.tick != number:
            continue
        trace = kept[0]
        _say(f"tick {number}: {again.status}{f' ({again.why})' if again.why else ''}")
        _say(
            "; ".join(map(str, again.differences))
            or f"{trace.advisory.kind}: {trace.advisory.directive or 'nothing said'}"
        )
        if trace.request is not None and again.status != "undecidable":
            profile = at_hand.of(trace.decision.profile, trace.decision.profile_sha256)
            _say(explain(trace.request, msgspec.convert(trace.decision.own, Inputs), profile).text)
        return int(again.status != "identical")
    raise UserError(f"--tick {number}: the log has no such tick")


def _unsound(paths: list[Path], given: list[str]) -> list[str]:
    """Where a drive's log is not as it was written; what is decided from one that is not proves nothing."""
    reports = [verify(path, expected_head=known_head(path).head) for path in paths]
    changed = [
        f"{one.file} is not as it was written: {one.first_bad or 'it lacks the head that memory knows'}"
        for one in reports
        if not one.intact
    ]
    return [*changed, *broken_links(reports), *gone_files(given)]


def _differing(ticks: Iterable[Again]) -> list[Again]:
    return [one for one in ticks if one.status == "different"]


def _tell(ticks: list[Again], counts: Counter[str], *, everything: bool) -> None:
    differing = _differing(ticks)
    _list(differing, everything=everything)
    for why, count in Counter(one.why for one in ticks if one.status == "undecidable").most_common(5):
        _say(f"{count} ticks cannot be decided again: {why}")
    undecidable = f", {counts['undecidable']} not decidable" if counts["undecidable"] else ""
    _say(f"{len(ticks)} ticks, {counts['identical']} identical decisions, {counts['different']} different{undecidable}")


def _list(differing: Sequence[Again | Otherwise], *, everything: bool, most: int | None = 4) -> None:
    """Each tick with its first differences, `most` of them."""
    for one in differing if everything else differing[:LISTED]:
        _say(f"tick {one.tick}: " + "; ".join(map(str, one.differences[:most])))
    if len(differing) > LISTED and not everything:
        _say(f"... and {len(differing) - LISTED} more ticks (--all lists them)")


def _change(flags: argparse.Namespace) -> Change:
    if flags.mu is not None and not 0 < flags.mu <= 1.5:
        raise UserError("--mu takes a friction above 0 and up to 1.5")
    if flags.delta is not None and not -1 <= flags.delta <= 2:
        raise UserError("--delta takes a margin between -1 and 2")
    return Change(delta=flags.delta, mu=flags.mu, book=_book(flags.rulepack) if flags.rulepack else None)


def _book(names: list[str]) -> RuleBook:
    folders = [data(f"rulepacks/{name}") if has_data(f"rulepacks/{name}") else Path(name) for name in names]
    book, refused = load_book(folders)
    if refused:
        raise UserError(f"rulepack refused: {refused[0]}")
    return book


def _suppose(log: Iterable[TraceRecord], change: Change, at_hand: AtHand, flags: argparse.Namespace) -> int:
    try:
        ticks = list(otherwise(log, change, at_hand))
    except UnknownProfile as error:
        raise UserError(str(error)) from None
    if not ticks:
        raise UserError("no tick of this log can be decided again: it holds no whole state")
    differing = [one for one in ticks if one.differences]
    if flags.json:
        _say(msgspec.json.encode({"ticks": len(ticks), "differing": differing}).decode())
        return 0
    _list(differing, everything=flags.all, most=None)
    _say(f"{len(ticks)} ticks, {len(differing)} would have differed{_by_field(differing)}")
    return 0


def _by_field(differing: list[Otherwise]) -> str:
    fields = Counter(field for one in differing for field in {d.field.split(".")[0] for d in one.differences})
    kinds = Counter(f"{one.logged_kind} to {one.kind}" for one in differing if one.kind != one.logged_kind)
    parts = [f"{name} in {count}" for name, count in (*fields.most_common(), *kinds.most_common())]
    return f": {', '.join(parts)}" if parts else ""


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
