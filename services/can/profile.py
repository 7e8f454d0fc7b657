"""A vehicle profile: which signal of which DBC feeds which curated field, and when it is believed."""

import math
import tomllib
from pathlib import Path

import msgspec

from services.can.errors import ProfileError

# (unit in the DBC, unit of the field) -> factor. A pair that is not here is a profile error, never a guess.
CONVERSIONS: dict[tuple[str, str], float] = {
    ("km/h", "m/s"): 1 / 3.6,
    ("m/s", "m/s"): 1.0,
    ("mph", "m/s"): 0.44704,
    ("m/s2", "m/s2"): 1.0,
    ("g", "m/s2"): 9.80665,
    ("deg/s", "rad/s"): math.pi / 180,
    ("rad/s", "rad/s"): 1.0,
    ("deg", "rad"): math.pi / 180,
    ("rad", "rad"): 1.0,
    ("bar", "bar"): 1.0,
    ("kPa", "bar"): 0.01,
    ("%", "share"): 0.01,
    ("degC", "degC"): 1.0,
    ("V", "V"): 1.0,
}


class FieldRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where a field comes from and what is plausible, in the field's unit."""

    signal: str
    unit: str = ""
    factor: float = 1.0
    minimum: float = 0.0
    maximum: float = 1.0
    max_step_per_s: float | None = None
    max_age_s: float = 0.5
    counter: str = ""
    valid_if: str = ""


class VehicleRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the health table must know of the car."""

    tyre_nominal_bar: tuple[float, float, float, float]
    steering_ratio: float = 15.0


class FaultRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fault scenario of the simulated car's test unit."""

    routine: int
    description: str


class Profile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One kind of car."""

    name: str
    dbc: str
    vehicle: VehicleRow
    ecus: dict[str, str]
    fields: dict[str, FieldRule]
    fault_scenarios: dict[str, FaultRow] = {}
    """Empty on a real car."""

    @property
    def ecu_names(self) -> dict[int, str]:
        """Physical request id -> name of the control unit."""
        return {int(request_id, 16): name for request_id, name in self.ecus.items()}


def load_profile(path: Path) -> Profile:
    """The profile at `path`. Raises ProfileError, naming what is wrong."""
    try:
        return msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), Profile, strict=False)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise ProfileError(f"{path.name}: {error}") from error


def conversion(dbc_unit: str, rule: FieldRule) -> float:
    """What a raw physical value is multiplied with to become the field's value."""
    if not rule.unit:
        return rule.factor
    try:
        return CONVERSIONS[dbc_unit, rule.unit] * rule.factor
    except KeyError:
        raise ProfileError(f"{rule.signal}: no conversion from {dbc_unit!r} to {rule.unit!r}") from None
