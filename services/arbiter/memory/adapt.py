"""Feedback: bounded steps of Delta and c_min, and the slow way back to the calibrated values.

The paper's updates only ever lower Delta and raise c_min: after enough feedback every drive ends at both bounds. Ours
also relax, with the time constant `relax_s`.
"""

import math

import msgspec

from proto.decision import Feedback
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Adapted

STEPS: dict[str, tuple[float, float]] = {
    "late_warning": (-1.0, 0.0),
    "false_positive": (0.0, 1.0),
    "override": (0.0, 1.0),
    "annoying": (0.0, 0.5),
    "helpful": (0.0, 0.0),
}
"""Label: steps of k_late on Delta, steps of k_fp on c_min."""


def relax(adapted: Adapted, now_ns: int, profile: Profile) -> Adapted:
    """Both values a little nearer to the calibrated ones."""
    if adapted.updated_ns is None or now_ns <= adapted.updated_ns:
        return msgspec.structs.replace(adapted, updated_ns=max(now_ns, adapted.updated_ns or now_ns))
    keep = math.exp(-(now_ns - adapted.updated_ns) / 1e9 / profile.relax_s)
    return Adapted(
        delta=profile.delta + (adapted.delta - profile.delta) * keep,
        c_min=profile.c_min + (adapted.c_min - profile.c_min) * keep,
        updated_ns=now_ns,
    )


def learn(adapted: Adapted, feedback: tuple[Feedback, ...], profile: Profile) -> Adapted:
    """One bounded step per label, never past the profile's bounds."""
    for label in feedback:
        late, wrong = STEPS[label.label]
        delta = min(profile.delta_high, max(profile.delta_low, adapted.delta + late * profile.k_late))
        c_min = min(profile.c_min_high, max(profile.c_min_low, adapted.c_min + wrong * profile.k_fp))
        adapted = msgspec.structs.replace(adapted, delta=delta, c_min=c_min)
    return adapted


def is_within_bounds(adapted: Adapted, profile: Profile) -> bool:
    """Whether both values lie between those of the profile."""
    return (
        profile.delta_low <= adapted.delta <= profile.delta_high
        and profile.c_min_low <= adapted.c_min <= profile.c_min_high
    )


def within_bounds(adapted: Adapted, profile: Profile) -> Adapted:
    """A stored value under today's profile: one outside the bounds (another profile, a damaged file) is calibrated."""
    if is_within_bounds(adapted, profile):
        return Adapted(delta=adapted.delta, c_min=adapted.c_min)
    return Adapted(delta=profile.delta, c_min=profile.c_min)
