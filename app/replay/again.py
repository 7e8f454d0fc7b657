"""Decides every tick again from its trace: the orchestrator's part and the arbiter's, bit for bit. Pure.

The orchestrator's state after a tick is known from a trace that carries it whole (the first, and every hundredth), or by
having decided that tick again with the same result. After a gap, ticks up to the next whole state cannot be decided again;
they are counted as such, never as identical.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Literal

import msgspec

from app.drive.precheck import profile_of
from app.replay.differences import Difference, differences
from drivemcp.errors import MALFORMED, UserError
from proto import topics
from proto.decision import TraceRecord
from services.arbiter import decide as arbiter
from services.arbiter.profiles.profile import Profile, load, names
from services.logger.format.reader import messages
from services.orchestrator.state import State, digest
from services.orchestrator.tick import redecide, state_of


def traces(paths: Iterable[Path]) -> Iterator[TraceRecord]:
    """Every trace of the files, which are read one after the other. Raises UserError where one cannot be used."""
    decoder = msgspec.json.Decoder(TraceRecord)
    for path in paths:
        for logged in messages(path):
            if logged.name == topics.TRACE.name:
                try:
                    yield decoder.decode(logged.data)
                except MALFORMED as error:
                    raise UserError(
                        f"{path}: trace {logged.sequence} does not fit this version's TraceRecord: {error}"
                    ) from None


class UnknownProfile(LookupError):
    """The log names a profile that is not at hand with the same content."""


class AtHand:
    """By their content: a file counts whatever its name is. Raises UserError where one is no profile."""

    def __init__(self, files: Sequence[Path] = ()) -> None:
        self._named = {profile.sha256: profile for profile in (profile_of("--profile", str(file)) for file in files)}

    def of(self, name: str, sha256: str) -> Profile:
        """The one of that name and content. Raises UnknownProfile."""
        return self._named.get(sha256) or _shipped(name, sha256)


@cache
def _shipped(name: str, sha256: str) -> Profile:
    if name not in names():
        raise UnknownProfile(f"profile {name!r} is not shipped: give its file with --profile FILE")
    profile = load(name)
    if profile.sha256 != sha256:
        raise UnknownProfile(
            f"profile {name!r} here has other constants than the log's (SHA-256 {sha256[:12]}): give that file with "
            "--profile FILE"
        )
    return profile


LOCAL = "local"
"""The profile that a decision names which the orchestrator took itself, the arbiter being away."""
SHIPPED = AtHand()
_MEASURED = {"event_to_advice_ms": None, "snapshot_to_advice_ms": None}

Status = Literal["identical", "different", "undecidable"]


class Again(msgspec.Struct, frozen=True, kw_only=True):
    """One tick decided again."""

    tick: int
    status: Status
    differences: tuple[Difference, ...] = ()
    why: str = ""
    """Why it could not be decided again."""


def decide_again(traces: Iterable[TraceRecord], at_hand: AtHand = SHIPPED) -> Iterator[Again]:
    """Every tick, in order. Raises UserError for a whole state that does not fit."""
    before: State | None = None
    last: int | None = None
    for trace in traces:
        if trace.tick == 1:
            before = State()  # a drive begins
        elif last is None or trace.tick != last + 1:
            before = None
        orchestrator, after = _orchestrator(before, trace)
        yield _joined(trace.tick, orchestrator, _arbiter(trace, at_hand))
        before, last = after, trace.tick


def _orchestrator(before: State | None, trace: TraceRecord) -> tuple[Again, State | None]:
    """This tick again, and the state to go on from."""
    if before is None:
        why = "the orchestrator's state before it is not in the log"
        return Again(tick=trace.tick, status="undecidable", why=why), known_state(trace)
    try:
        again = redecide(before, trace)
    except msgspec.ValidationError as error:
        return Again(tick=trace.tick, status="undecidable", why=f"its inputs do not fit: {error}"), known_state(trace)
    if not again.differences:
        return Again(tick=trace.tick, status="identical"), again.ticked.state
    ticked = again.ticked
    pairs = (
        ("events", trace.events, ticked.events),
        ("fused", trace.fused, ticked.fused),
        ("request", trace.request, ticked.request),
        ("decision", trace.decision, ticked.decision),
        (
            "advisory",
            msgspec.structs.replace(trace.advisory, **_MEASURED),
            msgspec.structs.replace(ticked.advisory, **_MEASURED),
        ),
        ("calls", [call.tool for call in trace.calls], [call.tool for call in ticked.outcomes]),
        ("state_sha256", trace.state_sha256, digest(ticked.state)),
    )
    found = tuple(one for name, logged, new in pairs for one in differences(name, logged, new))
    # go on from the logged state where there is one, so that one difference is not told of every later tick
    named = found or tuple(Difference(field=name, logged="", again="otherwise") for name in again.differences)
    return Again(tick=trace.tick, status="different", differences=named), known_state(trace)


def known_state(trace: TraceRecord) -> State | None:
    """The whole state after a tick whose trace carries it. Raises UserError where it does not fit."""
    try:
        return state_of(trace)
    except msgspec.ValidationError as error:
        raise UserError(f"the state of tick {trace.tick} does not fit this version: {error}") from None


def _arbiter(trace: TraceRecord, at_hand: AtHand) -> Again:
    logged = trace.decision
    if trace.request is None or logged.profile == LOCAL:
        return Again(tick=trace.tick, status="identical")  # the orchestrator's own rule, decided again above
    try:
        verdict = arbiter.redecide(trace.request, logged, at_hand.of(logged.profile, logged.profile_sha256))
    except UnknownProfile as error:
        return Again(tick=trace.tick, status="undecidable", why=str(error))
    except msgspec.ValidationError as error:
        return Again(tick=trace.tick, status="undecidable", why=f"the arbiter's inputs do not fit: {error}")
    found = tuple(differences("decision", logged, verdict.decision))
    return Again(tick=trace.tick, status="different" if found else "identical", differences=found)


def _joined(tick: int, one: Again, other: Again) -> Again:
    """Both parts: different if one is, undecidable if one is, identical only if both are."""
    statuses = {one.status, other.status}
    status: Status = (
        "different" if "different" in statuses else "undecidable" if "undecidable" in statuses else "identical"
    )
    return Again(
        tick=tick,
        status=status,
        differences=one.differences + other.differences,
        why="; ".join(part for part in (one.why, other.why) if part),
    )


COMPARED = ("tick", "stamp_ns", "cause", "events", "fused", "request", "decision", "advisory", "state_sha256")
"""All that was decided, and the hash of all that was remembered. Call ids and measured times of calls are no decisions."""


def side_by_side(one: Iterable[TraceRecord], other: Iterable[TraceRecord]) -> Iterator[Again]:
    """Tick by tick, in the order of the two logs."""
    for first, second in zip_longest(one, other):
        if first is None or second is None:
            tick = (first or second).tick
            lacking = Difference(field="trace", logged=str(first is not None), again=str(second is not None))
            yield Again(tick=tick, status="different", differences=(lacking,))
            continue
        pairs = ((name, getattr(first, name), getattr(second, name)) for name in COMPARED)
        found = tuple(one for name, logged, new in pairs for one in differences(name, logged, new))
        yield Again(tick=first.tick, status="different" if found else "identical", differences=found)
