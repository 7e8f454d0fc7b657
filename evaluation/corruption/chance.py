"""Chance by name: a keyed hash instead of a stream, so that no draw depends on what was drawn before it."""

from hashlib import blake2b

_PARTS = 2.0**53


def chance(seed: int, *names: str | int) -> float:
    """A number in [0, 1) that depends on the seed and the names alone, evenly spread over names."""
    text = "\x1f".join(map(str, (seed, *names)))
    return (int.from_bytes(blake2b(text.encode(), digest_size=8).digest()) >> 11) / _PARTS


def ranked(seed: int, values: frozenset[int], *names: str | int) -> tuple[int, ...]:
    """The values in an order that depends on the seed and the names alone."""
    return tuple(sorted(values, key=lambda value: (chance(seed, *names, value), value)))
