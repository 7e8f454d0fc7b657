"""From the signals of one decoded message to one sample of a field, as the profile's rule says."""

from collections.abc import Callable, Mapping
from statistics import fmean
from typing import Any

from services.can.errors import ProfileError
from services.can.profiles.extract import signal_of
from services.can.profiles.profile import FieldRule, transform

Sample = Callable[[Mapping[str, float]], float | None]
"""Signal name -> physical value, choices as numbers; gives the field's value, None for a value that has no meaning."""

_COMBINE: dict[str, Callable[[list[float]], float]] = {"mean": fmean, "min": min, "max": max, "sum": sum}


def source(rule: FieldRule, message: Any) -> Sample:
    """How a field is read from `message` (cantools). Raises ProfileError where the message has not what the rule names."""
    signals = [signal_of(message, name) for name in rule.signals]
    for name in rule.others:
        signal_of(message, name)
    reads = [_mapped(rule, each) if rule.values else _scaled(rule, each) for each in signals]
    reads = [_weighted(*each) for each in zip(reads, rule.weights, strict=True)] if rule.weights else reads
    one = reads[0] if len(reads) == 1 else _combined(reads, _COMBINE[rule.combine])
    return _negated(one, rule.negative_if) if rule.negative_if else one


def usable(rule: FieldRule, message: Any) -> Callable[[Mapping[str, float]], bool]:
    """Whether the sender vouches for the field in these values, by the rule's `valid_if`. Raises ProfileError."""
    if not rule.valid_if:
        return lambda values: True
    name, signal = rule.valid_if, signal_of(message, rule.valid_if)
    if not rule.valid_values:
        return lambda values: bool(values[name])
    good = {_physical(signal, str(each)) for each in rule.valid_values}
    return lambda values: values[name] in good


def _scaled(rule: FieldRule, signal: Any) -> Sample:
    name, (scale, offset) = signal.name, transform(signal.unit or "", rule)
    return lambda values: values[name] * scale + offset


def _mapped(rule: FieldRule, signal: Any) -> Sample:
    name, otherwise = signal.name, rule.otherwise
    table = {_physical(signal, key): value for key, value in rule.values.items()}
    return lambda values: table.get(values[name], otherwise)


def _physical(signal: Any, key: str) -> float:
    """The number that a raw value or a named one decodes to."""
    named = {str(text): raw for raw, text in (signal.choices or {}).items()}
    try:
        raw = named[key] if key in named else int(key, 0)
    except ValueError:
        raise ProfileError(f"{signal.name}: no value {key!r}; named are {', '.join(named) or 'none'}") from None
    return float(signal.conversion.raw_to_scaled(raw, decode_choices=False))


def _weighted(read: Sample, weight: float) -> Sample:
    def weighted(values: Mapping[str, float]) -> float | None:
        value = read(values)
        return None if value is None else value * weight

    return weighted


def _combined(reads: list[Sample], combine: Callable[[list[float]], float]) -> Sample:
    def read(values: Mapping[str, float]) -> float | None:
        found = [value for each in reads if (value := each(values)) is not None]
        return combine(found) if len(found) == len(reads) else None

    return read


def _negated(one: Sample, flag: str) -> Sample:
    def read(values: Mapping[str, float]) -> float | None:
        value = one(values)
        return -value if value is not None and values[flag] else value

    return read
