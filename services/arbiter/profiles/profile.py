"""Profiles: every constant of the arbiter with symbol, unit, source and reason; and whether ACT can be reached."""

import hashlib
from pathlib import Path
from typing import Any, Literal

import msgspec

from services.arbiter.profiles.errors import ProfileError

FOLDER = Path(__file__).parent


class Constant(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One row of a profile file."""

    symbol: str
    value: float
    unit: str
    source: str
    reason: str


class ProfileFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A profile as its file has it."""

    name: str
    about: str
    ttc: Literal["paper", "braking"]
    rss: Literal["paper", "full"]
    constants: dict[str, Constant]


class Profile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The constants as numbers; meanings and sources stand in the file, symbols in docs/explanation/safety.md."""

    name: str
    ttc: Literal["paper", "braking"]
    rss: Literal["paper", "full"]
    sha256: str
    epsilon_mps: float
    t_r_s: float
    d0_m: float
    tau_s: float
    alpha: float
    beta: float
    gamma: float
    delta: float
    c_act: float
    c_err: float
    b_adv: float
    c_fat: float
    mu_unknown_low: float
    mu_unknown_high: float
    mu_floor: float
    envelope_unknown: float
    h_unknown: float
    delta_low: float
    delta_high: float
    c_min: float
    c_min_low: float
    c_min_high: float
    k_late: float
    k_fp: float
    relax_s: float
    tau_hazard_s: float
    hazard_need_mps2: float
    hazard_spare_m: float
    hazard_repeat_s: float
    speech_gap_s: float
    answer_mps2: float
    budget_messages: float
    budget_reserve: float
    budget_refill_s: float
    actor_floor: float
    hazard_confidence: float
    hazard_known_s: float
    speed_known_mps: float
    speed_sigmas: float
    across_sigmas: float
    act_confidence: float
    act_unseen_s: float
    act_track_age_s: float
    act_overlap_m: float
    person_stops_mps2: float
    vehicle_stops_mps2: float
    stands_mps: float
    standing_mps: float
    crawl_mps: float
    queued_m: float
    act_reading_age_s: float
    act_watched_s: float
    act_shrinks: float
    act_disagree_m: float
    act_brake_max_mps2: float
    act_brake_min_mps2: float
    act_jerk_mps3: float
    act_duration_s: float
    act_rest_s: float
    act_warned_s: float
    emergency_brake_max_mps2: float
    emergency_delay_s: float
    emergency_spare_m: float
    emergency_confidence: float
    emergency_unseen_s: float
    emergency_duration_s: float
    pedal_brake: float
    pedal_accelerator: float
    pedal_rise: float
    wheel_turn_rad: float
    brake_max_mps2: float
    accel_max_mps2: float
    oncoming_rho_s: float
    lat_accel_mps2: float
    lat_brake_mps2: float
    lat_fluctuation_m: float
    ego_length_m: float
    ego_width_m: float


class Reachability(msgspec.Struct, frozen=True, kw_only=True):
    """Whether ACT can happen at all under a profile and a Delta, and what it takes."""

    delta: float
    r_needed: float
    r_max: float
    r_max_healthy: float
    ttc_needed_healthy_s: float | None
    """The time to collision below which a healthy car that violates RSS is braked; None: never."""
    reachable: bool
    text: str


def load(name_or_path: str | Path) -> Profile:
    """A shipped profile by its name, or a file; raises ProfileError, or OSError where there is no such file."""
    path = FOLDER / f"{name_or_path}.toml" if str(name_or_path) in names() else Path(name_or_path)
    return parse(path.read_bytes(), str(name_or_path))


def names() -> tuple[str, ...]:
    """The shipped profiles."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def read_file(data: bytes, label: str = "profile") -> ProfileFile:
    """A profile file with symbols, sources and reasons; raises ProfileError."""
    try:
        return msgspec.toml.decode(data, type=ProfileFile)
    except (msgspec.MsgspecError, ValueError) as error:
        raise ProfileError(f"{label}: {error}") from error


def parse(data: bytes, label: str = "profile") -> Profile:
    """The constants of a profile file; raises ProfileError."""
    file = read_file(data, label)
    values: dict[str, Any] = {key: constant.value for key, constant in file.constants.items()}
    digest = hashlib.sha256(data).hexdigest()
    try:
        profile = msgspec.convert(
            {"name": file.name, "ttc": file.ttc, "rss": file.rss, "sha256": digest, **values}, type=Profile
        )
    except msgspec.ValidationError as error:
        raise ProfileError(f"{label}: {error}") from error
    _check(profile, file)
    return profile


def _check(profile: Profile, file: ProfileFile) -> None:
    for key, constant in file.constants.items():
        if not constant.source or not constant.reason or not constant.unit:
            raise ProfileError(f"{file.name}: {key} lacks its unit, source or reason")
        if not 0.0 <= constant.value < 1e6:
            raise ProfileError(f"{file.name}: {key} = {constant.value} is out of bounds")
    ordered = (
        (profile.delta_low, profile.delta, profile.delta_high, "delta"),
        (profile.c_min_low, profile.c_min, profile.c_min_high, "c_min"),
        (profile.mu_floor, profile.mu_unknown_low, profile.mu_unknown_high, "mu_unknown"),
        (profile.act_brake_min_mps2, profile.act_brake_max_mps2, 9.81, "act_brake"),
    )
    for low, value, high, what in ordered:
        if not low <= value <= high:
            raise ProfileError(f"{file.name}: {what} = {value} lies outside [{low}, {high}]")
    if profile.budget_reserve + 1.0 > profile.budget_messages:
        raise ProfileError(f"{file.name}: budget_reserve leaves no message of budget_messages for information")
    if min(profile.tau_s, profile.mu_floor, profile.relax_s, profile.budget_refill_s, profile.brake_max_mps2) <= 0.0:
        raise ProfileError(f"{file.name}: tau, mu_floor, relax, budget_refill and brake_max must be above 0")


def reachability(profile: Profile, delta: float | None = None) -> Reachability:
    """Solve U_act - U_speak > Delta for r: r > (Delta + C_act + C_err - C_fat) / (1 - B_adv)."""
    margin = profile.delta if delta is None else delta
    gain = 1.0 - profile.b_adv
    needed = (margin + profile.c_act + profile.c_err - profile.c_fat) / gain if gain > 0.0 else float("inf")
    healthy = profile.alpha + profile.beta
    most = healthy + profile.gamma
    share = (needed - profile.beta) / profile.alpha if profile.alpha > 0.0 else float("inf")
    ttc = profile.tau_s * (1.0 - share) if share < 1.0 else None
    reachable = needed < most
    verdict = "can be reached" if reachable else "cannot be reached"
    return Reachability(
        delta=margin,
        r_needed=needed,
        r_max=most,
        r_max_healthy=healthy,
        ttc_needed_healthy_s=ttc,
        reachable=reachable,
        text=f"profile {profile.name}, Delta {margin:.2f}: ACT {verdict}; it needs r > {needed:.3f}, r is at most "
        f"{most:.3f} ({healthy:.3f} in a healthy car)",
    )
