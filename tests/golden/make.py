"""Makes golden bytes of messages that have none yet: `python -m tests.golden.make`. Those that exist are never touched."""

import sys
import types
import typing
from enum import Enum
from pathlib import Path
from typing import Any, Literal

import msgspec

from proto.topics import TOPICS

FOLDER = Path(__file__).parent


def sample(kind: Any, depth: int = 0) -> Any:
    """A value of a type with every field set, the same each time."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return sample(arguments[0], depth)
    if origin in (typing.Union, types.UnionType):
        return sample(next(a for a in arguments if a is not type(None)), depth)
    if origin is Literal:
        return arguments[-1]
    if origin is tuple:
        inner = arguments[:1] if arguments[-1] is Ellipsis else arguments
        return () if depth > 4 else tuple(sample(a, depth + 1) for a in inner)
    if origin is dict:
        return {"a": sample(arguments[1], depth + 1)}
    struct = origin if isinstance(origin, type) else kind
    if isinstance(struct, type) and issubclass(struct, msgspec.Struct):
        fields = msgspec.structs.fields(kind)
        return struct(**{field.name: sample(field.type, depth + 1) for field in fields})
    if isinstance(struct, type) and issubclass(struct, Enum):
        return next(iter(struct))
    plain: dict[Any, Any] = {int: 7, float: 0.5, str: "a", bytes: b"\x01\x02", bool: True, Any: "any", type(None): None}
    return plain[kind]


def encode(kind: Any, encoding: str) -> bytes:
    """The sample as it goes on the wire."""
    value = sample(kind)
    return msgspec.msgpack.encode(value) if encoding == "msgpack" else msgspec.json.encode(value)


def main() -> int:
    """Write the missing ones."""
    for topic in TOPICS:
        path = FOLDER / f"{topic.message.__name__}.{topic.encoding}"
        if not path.exists():
            path.write_bytes(encode(topic.message, topic.encoding))
            sys.stdout.write(f"{path.name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
