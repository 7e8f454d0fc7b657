"""Judges a disturbed drive: the longest silence of its advice, and each rise of its target that the truth does not allow."""

from collections.abc import Sequence
from itertools import pairwise

import msgspec

from proto.services import OWNERS
from proto.topics import TOPICS
from tests.stack.chaos.watcher import Seen

BEFORE_S = 2.0
"""What advice was: over so long before a disturbance."""
NOTICED_MPS = 0.5
"""A target that rises by less follows what was known before."""
SOON_S = 6.0
"""Without a tick after a disturbance, on an idle machine."""
IDLE_START_S = 10.0
"""From the command to the 30th tick, on an idle machine with two cores."""


TELLS_NOTHING = frozenset({"arbiter", "cockpit", "gateway", "logger", "retrieval"})
"""Services from which no target comes: without them it may rise as it would have."""


TRUE_OR_NOT = frozenset({"law", "lead", "person", "red_light", "stop_sign"})
"""Why a target was low, where the truth tells whether that still is. What was doubted or unknown it does not tell: that frees nothing."""


class Verdict(msgspec.Struct, frozen=True, kw_only=True):
    """What one disturbance came to."""

    what: str
    lasted_s: float
    silent_s: float
    """The longest time without a tick from its beginning on."""
    back_s: float | None
    """From its beginning until advice lacks no more than it did before; None: not within the time that was watched."""
    rise_mps: float
    """By how much the target was above all targets before and above what the truth allows, while information was missing."""
    why: str = ""
    """What bounded before and at that rise."""

    def line(self) -> str:
        """As a person reads it."""
        back = f"{self.back_s:5.1f}" if self.back_s is not None else "    -"
        silent, rise = f"silent {self.silent_s:5.2f} s", f"target +{self.rise_mps:.2f} m/s {self.why}"
        return f"{self.what:24} {self.lasted_s:5.1f} s  {silent}  whole after {back} s  {rise}"


def judge(what: str, seen: Sequence[Seen], from_s: float, to_s: float, until_s: float, process: str = "") -> Verdict:
    """A disturbance from `from_s` to `to_s`, watched until `until_s`: of one process; of all, where none is named."""
    before = [each for each in seen if from_s - BEFORE_S <= each.at_s < from_s]
    after = [each for each in seen if from_s <= each.at_s <= until_s]
    instants = [from_s, *(each.at_s for each in after), until_s]
    usual = set().union(*(each.degraded for each in before))
    whole = next((each for each in after if each.at_s >= to_s and set(each.degraded) <= usual), None)
    missing = [each for each in after if whole is None or each.at_s < whole.at_s]
    lacking = [each for each in missing if any(_comes_from(process, name) for name in set(each.degraded) - usual)]
    rise_mps, at = max(((_rise(each, before), each) for each in lacking), key=lambda one: one[0], default=(0.0, None))
    return Verdict(
        what=what, lasted_s=to_s - from_s, silent_s=max(b - a for a, b in pairwise(instants)),
        back_s=whole.at_s - from_s if whole is not None else None,
        rise_mps=rise_mps, why=f"{before[-1].why} to {at.why}" if at is not None and rise_mps > 0.0 else "",
    )  # fmt: skip


def _comes_from(process: str, name: str) -> bool:
    """Whether it is for the want of this process that advice is degraded by `name`, and a target could come from it."""
    if process in TELLS_NOTHING:
        return False
    if process in ("", "router", "orchestrator"):
        return name not in TELLS_NOTHING
    published = any(topic.name == name and process in topic.publishers for topic in TOPICS)
    return name == process or published or OWNERS.get(name.removeprefix("tool:")) == process


def _rise(seen: Seen, before: Sequence[Seen]) -> float:
    """Above what was advised before; no target is no rise, and neither is one that the truth allows by now."""
    most = max((each.target_mps for each in before if each.target_mps is not None), default=None)
    if most is None or seen.target_mps is None:
        return 0.0
    if seen.allowed_mps is not None and all(each.why in TRUE_OR_NOT for each in before):
        most = max(most, seen.allowed_mps)
    return max(0.0, seen.target_mps - most)


def slowness(start_s: float) -> float:
    """How many times slower than idle the machine is, by how long a drive took to come to its stride."""
    return max(1.0, start_s / IDLE_START_S)
