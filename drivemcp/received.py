"""A publication as a subscriber gets it."""

from typing import Generic, TypeVar

import msgspec

from proto.topics import Topic

M = TypeVar("M", bound=msgspec.Struct)

_DECODERS: dict[
    type[msgspec.Struct], tuple[msgspec.msgpack.Decoder[msgspec.Struct], msgspec.json.Decoder[msgspec.Struct]]
] = {}


class Received(msgspec.Struct, Generic[M], frozen=True):
    """The message and what its head says. For a raw subscription `message` is None and `payload` the bytes as sent."""

    message: M
    key: str
    id: str
    seq: int
    stamp_ns: int
    sent_ns: int
    publisher: str
    payload: bytes = b""


def decode(topic: Topic[M], payload: bytes) -> M:
    """The message of a payload. Raises msgspec.MsgspecError where it does not fit the topic's type."""
    pair = _DECODERS.get(topic.message)
    if pair is None:
        pair = (msgspec.msgpack.Decoder(topic.message), msgspec.json.Decoder(topic.message))
        _DECODERS[topic.message] = pair
    return pair[0 if topic.encoding == "msgpack" else 1].decode(payload)  # type: ignore[return-value]
