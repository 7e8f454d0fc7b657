"""What is fitted, between which bounds and why; what the safety properties rest on stands in no row."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import msgspec

from services.arbiter.profiles.profile import Profile, reachability
from services.orchestrator.events import ETA

DELTAS = (0.0, 0.1, 0.2, 0.3, 0.4)
"""ACT must stay within reach at each, and sooner at a smaller one."""
ACTS_FROM_S, ACTS_BY_S = 1.4, 3.0
"""Times to collision between which a healthy car that violates RSS is to be braked at the profile's own Delta: below, hardly
any speed is taken off; above, drivers still brake themselves (van der Horst and Hogema 1993)."""
EVENT = "event."


class Row(NamedTuple):
    """One constant: a field of the profile, or `event.` and a kind of event."""

    name: str
    low: float
    high: float
    unit: str
    reason: str


ROWS: tuple[Row, ...] = (
    Row("tau_s", 3.0, 5.0, "s", "3 to 5 s part drivers in control from drivers in trouble, by the source of the 4 s"),
    Row("c_act", 0.15, 0.45, "1", "with the others as they are: ACT within reach at every Delta of the paper's table"),
    Row("c_min", 0.4, 0.7, "1", "c_min_low, below which feedback never goes, to short of c_min_high"),
    Row("act_confidence", 0.7, 0.9, "1", "a guard: the fit may ask for more, never for less"),
    Row("act_track_age_s", 0.3, 0.8, "s", "a guard, as act_confidence; 0.8 s is what a cut-in leaves"),
    Row("act_watched_s", 0.25, 0.6, "s", "a guard, as act_confidence; sightings are kept for 0.7 s"),
    Row("act_shrinks", 0.5, 0.85, "1", "a guard, as act_confidence; measured speeds are off by a tenth themselves"),
    Row("tau_hazard_s", 2.0, 4.0, "s", "ISO 15623 family of forward collision warnings: 2 to 4 s"),
    Row("hazard_confidence", 0.4, 0.7, "1", "from the event's own threshold to what supports ACT"),
    Row("speed_sigmas", 2.0, 4.0, "1", "one in 40 to one in 30,000 measured speeds is so far off by chance"),
    Row(
        "hazard_repeat_s",
        2.0,
        6.0,
        "s",
        "one spoken phrase to three; after 4 s a repeat is no nag (evaluation.metrics)",
    ),
    Row("budget_messages", 2.0, 6.0, "1", "a limit and what it means are two messages; six in a row are too many"),
    Row("budget_refill_s", 5.0, 30.0, "s", "two to twelve messages a minute in the long run"),
    Row(f"{EVENT}closing_lead", 0.2, 0.33, "1/s", "times to collision of 5 to 3 s: ISO 15623 as above"),
    Row(f"{EVENT}vulnerable_road_user", 0.3, 0.5, "1", "confidence; above one half no road user may be overlooked"),
    Row(f"{EVENT}stop_required", 0.25, 0.5, "m/s^2", "told no later than comfort braking (ISO 15622: 3.5) is far off"),
    Row(f"{EVENT}low_friction", 0.25, 0.4, "1", "wet asphalt 0.25, flooded 0.5"),
    Row(f"{EVENT}vehicle_fault", 0.1, 0.2, "1", "h; a code or lamp alone makes 0.2"),
    Row(f"{EVENT}overspeed", 0.03, 0.07, "1", "speedometers may show a few per cent more; 3 km/h are tolerated"),
    Row(f"{EVENT}foreign_sign", 0.35, 0.7, "1", "confidence"),
    Row(f"{EVENT}jurisdiction_change", 0.45, 0.75, "1", "confidence"),
    Row(f"{EVENT}dynamic_limit_update", 0.2, 0.44, "1", "confidence"),
)
"""The rows leave out the RSS constants, the unknown-is-careful values, and the bounds of braking, jerk, duration, pedals, Delta and
c_min. Delta itself is the user's choice. The paper's alpha, beta, gamma, C_err, B_adv and C_fat are left out, since C_act already
moves what ACT needs. k_late, k_fp and relax_s move nothing in a drive without labels: see `feedback.py`."""
BY_NAME: Mapping[str, Row] = {row.name: row for row in ROWS}


class Candidate(msgspec.Struct, frozen=True, kw_only=True):
    """A value for each row."""

    values: dict[str, float]

    @property
    def constants(self) -> dict[str, float]:
        """Those of the profile."""
        return {name: value for name, value in self.values.items() if not name.startswith(EVENT)}

    @property
    def thresholds(self) -> dict[str, float]:
        """Those of events, by kind."""
        return {name.removeprefix(EVENT): value for name, value in self.values.items() if name.startswith(EVENT)}

    def profile(self, base: Profile) -> Profile:
        """The profile with these constants."""
        return msgspec.structs.replace(base, **self.constants)

    def moved(self, name: str, value: float) -> "Candidate":
        """With one value otherwise."""
        return Candidate(values={**self.values, name: value})


def shipped(base: Profile) -> Candidate:
    """What a profile and the event table say now."""
    return Candidate(
        values={
            row.name: ETA[row.name.removeprefix(EVENT)] if row.name.startswith(EVENT) else getattr(base, row.name)
            for row in ROWS
        }
    )


def scaled(candidate: Candidate) -> list[float]:
    """Each value within its bounds, 0 to 1, in the order of the rows."""
    return [(candidate.values[row.name] - row.low) / (row.high - row.low) for row in ROWS]


def unscaled(places: Sequence[float]) -> Candidate:
    """The values at these places between the bounds, to four digits: what is written is what was tried."""
    return Candidate(
        values={
            row.name: float(f"{row.low + min(1.0, max(0.0, place)) * (row.high - row.low):.4g}")
            for row, place in zip(ROWS, places, strict=True)
        }
    )


def unfit(candidate: Candidate, base: Profile) -> str:
    """Why the design refuses a candidate; empty: it does not."""
    for row in ROWS:
        if not row.low - 1e-9 <= candidate.values[row.name] <= row.high + 1e-9:
            return f"{row.name} = {candidate.values[row.name]:g} {row.unit} lies outside [{row.low:g}, {row.high:g}]"
    profile = candidate.profile(base)
    if not profile.c_min_low <= profile.c_min <= profile.c_min_high:
        return "c_min lies outside the bounds of feedback"
    out_of_reach = [delta for delta in DELTAS if not reachability(profile, delta).reachable]
    times = [reachability(profile, delta).ttc_needed_healthy_s for delta in DELTAS]
    if out_of_reach or None in times:
        return f"ACT is out of reach at Delta {out_of_reach or [d for d, t in zip(DELTAS, times, strict=True) if t is None]}"
    own = reachability(profile).ttc_needed_healthy_s
    if own is None or not ACTS_FROM_S <= own <= ACTS_BY_S:
        return f"a healthy car is braked for below {own or 0.0:.2f} s, which lies outside [{ACTS_FROM_S}, {ACTS_BY_S}]"
    return ""
