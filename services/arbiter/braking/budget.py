"""How long the car may be braked within a sliding window, whatever pauses, clock or restarts.

Times are ns of the arbiter's own running clock (`ArbiterState.run_ns`): it advances by what passes between two decisions,
never backward and never by more than a second at once. So neither a clock that is set nor a pause makes braking forgotten.
"""

import math

from services.arbiter.state import Braked, Intervention, Owed

COMMAND_NS = 100_000_000
"""What one command counts: the time until the next."""
VALID_NS = 200_000_000
"""So long a command holds at the receiver."""
PAUSE_NS = 500_000_000
"""A pause of less counts as braked through."""
RESERVED_S = 1.0
"""Braking is written down so far ahead: a restart in the midst of it forgets nothing, and a file is written once a second."""
LONGEST_STEP_NS = 1_000_000_000
"""The running clock advances by no more between two decisions."""


def advanced(run_ns: int, seen_ns: int | None, now_ns: int) -> int:
    """The running clock at `now_ns` on the wall clock; `seen_ns`: the wall clock at the decision before."""
    if seen_ns is None:
        return run_ns
    return run_ns + min(max(0, now_ns - seen_ns), LONGEST_STEP_NS)


def spent_s(braked: tuple[Braked, ...], run_ns: int, window_s: float) -> float:
    """Seconds braked within the last `window_s`."""
    since_ns = run_ns - round(window_s * 1e9)
    return sum(max(0, each.until_ns - max(each.from_ns, since_ns)) for each in braked) / 1e9


def spend(braked: tuple[Braked, ...], run_ns: int) -> tuple[Braked, ...]:
    """With a command of this moment counted."""
    until_ns = run_ns + COMMAND_NS
    if braked and run_ns - braked[-1].until_ns < PAUSE_NS:
        return (*braked[:-1], Braked(from_ns=braked[-1].from_ns, until_ns=max(until_ns, braked[-1].until_ns)))
    return (*braked, Braked(from_ns=run_ns, until_ns=until_ns))


def kept(braked: tuple[Braked, ...], run_ns: int, window_s: float) -> tuple[Braked, ...]:
    """Without what lies before the window."""
    since_ns = run_ns - round(window_s * 1e9)
    return tuple(each for each in braked if each.until_ns > since_ns)


def owed(running: Intervention, run_ns: int, before: Owed) -> Owed:
    """What is to be written down, where `before` is: not less than was braked, and by whole seconds."""
    braked_s = sum(each.until_ns - each.from_ns for each in running.braked) / 1e9
    rests = running.rest_until_ns is not None and run_ns < running.rest_until_ns
    if 0.0 < braked_s <= before.braked_s:
        return Owed(braked_s=before.braked_s, rests=rests)
    return Owed(braked_s=math.floor(braked_s) + RESERVED_S if braked_s > 0.0 else 0.0, rests=rests)


def resumed(was: Owed, rest_s: float) -> Intervention:
    """The state to start with after a restart: what was braked counts as braked just now, and a rest begins anew."""
    since_ns = -round(min(max(0.0, was.braked_s), 3600.0) * 1e9)
    return Intervention(
        braked=(Braked(from_ns=since_ns, until_ns=0),) if since_ns < 0 else (),
        rest_until_ns=round(rest_s * 1e9) if was.rests else None,
    )
