"""A publication as a subscriber gets it."""

from typing import Any, Generic, TypeVar

import msgspec

from drivemcp.bus.inbox import Parcel
from drivemcp.errors import MALFORMED
from proto.topics import Topic
from proto.wire import PubHead

M = TypeVar("M", bound=msgspec.Struct)

_DECODERS: dict[
    type[msgspec.Struct], tuple[msgspec.msgpack.Decoder[msgspec.Struct], msgspec.json.Decoder[msgspec.Struct]]
] = {}
_HEAD = msgspec.msgpack.Decoder(PubHead)


class Received(msgspec.Struct, Generic[M], frozen=True):
    """The message and what its head says. For a raw subscription `message` is `None` and `payload` the bytes as sent."""

    message: M
    key: str
    id: str
    seq: int
    stamp_ns: int
    sent_ns: int
    publisher: str
    payload: bytes = b""
    epoch: int = 0
    """Of the publisher's process: `seq` counts within it."""


def decode(topic: Topic[M], payload: bytes) -> M:
    """The message of a payload. Raises msgspec.MsgspecError where it does not fit the topic's type."""
    pair = _DECODERS.get(topic.message)
    if pair is None:
        pair = (msgspec.msgpack.Decoder(topic.message), msgspec.json.Decoder(topic.message))
        _DECODERS[topic.message] = pair
    return pair[0 if topic.encoding == "msgpack" else 1].decode(payload)  # type: ignore[return-value]


def head_of(attachment: bytes) -> PubHead | None:
    """The head of a publication; None where it does not decode."""
    try:
        return _HEAD.decode(attachment)
    except MALFORMED:
        return None


def received_as(message: Any, parcel: Parcel, head: PubHead) -> Received[Any]:
    """A publication with its message; None stands for the bytes as they came."""
    return Received(
        message=message,
        key=parcel.key,
        id=parcel.key.split("/")[-2 if parcel.key.endswith(("/rx", "/tx")) else -1],
        seq=head.seq,
        stamp_ns=head.stamp_ns,
        sent_ns=head.sent_ns,
        publisher=head.publisher,
        payload=parcel.payload if message is None else b"",
        epoch=head.epoch,
    )
