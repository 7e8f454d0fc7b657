"""A vehicle profile: which signal of which bus feeds which curated field, and when it is believed."""

import math
import tomllib
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import msgspec

from services.can.errors import ProfileError
from services.can.profiles.curated import curated
from services.can.profiles.units import Linear, linear


class ChecksumRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A checksum in a message: the signal that holds it, how it is worked out, and what else goes into it."""

    signal: str
    kind: str
    data_ids: tuple[int, ...] = ()
    """Secret bytes that some makers add: one for the message, or one for each value of the counter."""


class MessageRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What guards a message, where the description does not say or says it wrongly."""

    bus: str = ""
    counter: str = ""
    checksum: ChecksumRule | None = None


class FieldRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where a field comes from and what is plausible, in the field's unit."""

    signal: str | tuple[str, ...]
    """Several signals, all of one message, make one value by `combine`."""
    message: str = ""
    """Needed where the signal's name is not unique on the bus."""
    bus: str = ""
    """May be left out with one bus."""
    vss: str = ""
    """Path in the COVESA Vehicle Signal Specification."""
    unit: str = ""
    """The field's unit; empty for flags, counts and named values."""
    dbc_unit: str = ""
    """What the signal is in, where the description does not say or says it wrongly."""
    sign: Literal[-1, 1] = 1
    factor: float = 1.0
    offset: float = 0.0
    """value = sign * factor * (the signal in the field's unit) + offset."""
    negative_if: str = ""
    """A signal of the same message: not 0 means that the value is negative."""
    combine: Literal["mean", "min", "max", "sum"] = "mean"
    values: dict[str, float] = {}
    """Named or raw value of the signal -> value of the field, e.g. { 0 = 0, "INT" = 1 }."""
    otherwise: float | None = None
    """The field for a raw value that `values` does not list. Unset: such a sample is not believed."""
    minimum: float = 0.0
    maximum: float = 1.0
    max_step_per_s: float | None = None
    max_age_s: float = 0.5
    counter: str = ""
    checksum: ChecksumRule | None = None
    valid_if: str = ""
    """A signal of the same message that must not be 0, or must have one of `valid_values` (names or raw numbers)."""
    valid_values: tuple[str | int, ...] = ()
    weights: tuple[float, ...] = ()
    """What each of several signals is multiplied with before `combine`, e.g. lamps that count 1, 2 and 3."""

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that make the value, in order."""
        return (self.signal,) if isinstance(self.signal, str) else self.signal

    @property
    def others(self) -> tuple[str, ...]:
        """The signals beside them that the same message must have."""
        checksum = self.checksum.signal if self.checksum else ""
        return tuple(filter(None, (self.negative_if, self.counter, checksum, self.valid_if)))


class BusRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One bus of the car: its description or descriptions (DBC, ARXML, KCD, SYM; a list is merged)."""

    description: str | tuple[str, ...]
    protocol: Literal["", "j1939"] = ""
    strict: bool = True
    """False: a field may be fed by a message whose signals overlap or do not fit its length."""

    @property
    def descriptions(self) -> tuple[str, ...]:
        """The files, as the profile names them."""
        return (self.description,) if isinstance(self.description, str) else self.description


class VehicleRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the health table must know of the car."""

    tyre_nominal_bar: tuple[float, float, float, float]
    track_m: float | None = None
    wheelbase_m: float | None = None
    brake_bar_per_mps2: float | None = None
    """Pressure that makes one m/s2 on dry road."""
    brake_bar_full_pedal: float | None = None


class FaultRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fault scenario of the simulated car's test unit."""

    routine: int
    description: str


class Profile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One kind of car."""

    name: str
    buses: dict[str, BusRule]
    vehicle: VehicleRow
    ecus: dict[str, str] = {}
    fields: dict[str, FieldRule]
    messages: dict[str, MessageRule] = {}
    fault_scenarios: dict[str, FaultRow] = {}
    """Empty on a real car."""

    @property
    def ecu_names(self) -> dict[int, str]:
        """Physical request id -> name of the control unit."""
        return {int(request_id, 16): name for request_id, name in self.ecus.items()}

    def bus_of(self, rule: FieldRule | MessageRule) -> str:
        """The bus that a rule means."""
        return rule.bus or next(iter(self.buses))


def load_profile(path: Path) -> Profile:
    """The profile at `path`. Raises ProfileError, naming file and field."""
    try:
        profile = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8-sig")), Profile, strict=False)
    except UnicodeDecodeError:
        raise ProfileError(f"{path.name}: it is not written in UTF-8; save it so") from None
    except (OSError, tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise ProfileError(f"{path.name}: {error}") from error
    if complaint := next(_complaints(profile), None):
        raise ProfileError(f"{path.parent.name}/{path.name}: {complaint}")
    return profile


def _complaints(profile: Profile) -> Iterator[str]:
    if not profile.buses:
        yield "no bus is named"
    guards: list[tuple[str, FieldRule | MessageRule]] = [
        (f"message {name}", each) for name, each in profile.messages.items()
    ]
    guards += [(f"field {name}", each) for name, each in profile.fields.items()]
    for where, each in guards:
        if each.bus and each.bus not in profile.buses:
            yield f"{where}: no bus {each.bus!r}"
        if not each.bus and len(profile.buses) > 1:
            yield f"{where}: which bus? one of {', '.join(profile.buses)}"
    for name, rule in profile.fields.items():
        yield from (f"field {name}: {complaint}" for complaint in _field_complaints(name, rule))


def _field_complaints(name: str, rule: FieldRule) -> Iterator[str]:
    try:
        meant = curated(name)
    except ProfileError as error:
        yield str(error)
        return
    if rule.vss != meant.vss:
        yield f"vss is {meant.vss}, not {rule.vss!r}"
    if rule.unit != meant.unit:
        yield f"unit is {meant.unit!r}, not {rule.unit!r}"
    if not (math.isfinite(rule.minimum) and math.isfinite(rule.maximum)):
        yield "minimum and maximum must be numbers"
    if rule.minimum > rule.maximum:
        yield "minimum lies above maximum"
    if not rule.signals:
        yield "no signal"
    if rule.values and (rule.sign, rule.factor, rule.offset, rule.dbc_unit) != (1, 1.0, 0.0, ""):
        yield "values stand for themselves: no sign, factor, offset or dbc_unit"
    if rule.weights and len(rule.weights) != len(rule.signals):
        yield f"{len(rule.weights)} weights for {len(rule.signals)} signals"
    if rule.valid_values and not rule.valid_if:
        yield "valid_values says nothing without valid_if"
    if rule.otherwise is not None and not rule.values:
        yield "otherwise says nothing without values"


def find_description(name: str, profile: Path, folders: Sequence[Path] = ()) -> Path:
    """A description that the profile at `profile` names: beside it, in `folders`, or in an installed opendbc.

    Raises ProfileError, telling where it was looked for.
    """
    searched = (profile.parent, *folders, *_opendbc())
    for folder in searched:
        if (folder / name).is_file():
            return folder / name
    raise ProfileError(
        f"{profile.parent.name}/{profile.name}: no description {name!r} in {', '.join(map(str, searched))}; "
        "name its folder in description_folders"
    )


def find_descriptions(profile: Profile, path: Path, folders: Sequence[Path] = ()) -> dict[str, tuple[Path, ...]]:
    """Bus -> the files that describe it. Raises ProfileError."""
    return {
        bus: tuple(find_description(name, path, folders) for name in rule.descriptions)
        for bus, rule in profile.buses.items()
    }


def _opendbc() -> tuple[Path, ...]:
    """Where the public descriptions lie: those for tests, and those to try a car out."""
    spec = find_spec("opendbc")
    return (Path(spec.origin).parent / "dbc",) if spec is not None and spec.origin else ()


def transform(dbc_unit: str, rule: FieldRule) -> Linear:
    """What a physical value of one of the rule's signals goes through. Raises ProfileError."""
    try:
        into = linear(rule.dbc_unit or dbc_unit, rule.unit) if rule.unit else Linear()
    except ProfileError as error:
        raise ProfileError(f"{', '.join(rule.signals)}: {error}") from None
    return into.then(Linear(rule.sign * rule.factor, rule.offset))
