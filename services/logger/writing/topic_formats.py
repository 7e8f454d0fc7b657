"""How each topic stands in the log: JSON with its schema, Foxglove's protobuf for pictures and log lines."""

from functools import cache

import msgspec
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from proto import topics
from proto.health import ServiceLog
from proto.sensors import CameraFrame
from proto.topics import Topic
from services.logger.writing.log_file import Form, Record

LOGGED: tuple[Topic[msgspec.Struct], ...] = tuple(topic for topic in topics.TOPICS if topic.logged != "never")
"""What the topic table wants logged. Raw CAN frames and LiDAR sweeps are not among it."""
_LEVELS = {
    "debug": Log.DEBUG,
    "info": Log.INFO,
    "warning": Log.WARNING,
    "error": Log.ERROR,
    "critical": Log.FATAL,
}
GAP_TOPIC = "logger/gap"
_JSON = msgspec.json.Encoder()


class Gap(msgspec.Struct, frozen=True, kw_only=True):
    """What is missing at this place of the log, and why."""

    lost: int
    from_ns: int
    until_ns: int
    reason: str


@cache
def json_form(kind: type[msgspec.Struct]) -> Form:
    """The channel form of a Struct as JSON."""
    (refs,), definitions = msgspec.json.schema_components((kind,), ref_template="#/$defs/{name}")
    name = refs["$ref"].rsplit("/", 1)[1]
    schema = {**definitions.pop(name), **({"$defs": definitions} if definitions else {})}
    return Form(
        message_encoding="json",
        schema_name=f"drivemcp.{kind.__name__}",
        schema_encoding="jsonschema",
        schema=msgspec.json.encode(schema),
    )


@cache
def protobuf_form(kind: type[Message]) -> Form:
    """The channel form of a protobuf message: its schema is the set of file descriptors that it needs."""
    files: dict[str, FileDescriptor] = {}

    def collect(file: FileDescriptor) -> None:
        for needed in file.dependencies:
            collect(needed)
        files.setdefault(file.name, file)

    collect(kind.DESCRIPTOR.file)
    described = FileDescriptorSet()
    for file in files.values():
        file.CopyToProto(described.file.add())
    return Form(
        message_encoding="protobuf",
        schema_name=str(kind.DESCRIPTOR.full_name),
        schema_encoding="protobuf",
        schema=described.SerializeToString(),
    )


def record(
    topic: Topic[msgspec.Struct],
    message: msgspec.Struct,
    payload: bytes,
    *,
    name: str,
    sequence: int,
    stamp_ns: int,
    log_time_ns: int,
) -> Record:
    """The log record of a message: `name` is its topic with the id filled in, `payload` the bytes as they came.

    JSON payloads are kept byte for byte; MessagePack becomes the JSON of the same data, unknown fields included.
    """
    if isinstance(message, CameraFrame):
        form, data = protobuf_form(CompressedImage), _picture(message, camera=name.rsplit("/", 1)[1], stamp_ns=stamp_ns)
    elif isinstance(message, ServiceLog):
        form, data = protobuf_form(Log), _line(message, stamp_ns=stamp_ns)
    else:
        form = json_form(topic.message)
        data = payload if topic.encoding == "json" else _JSON.encode(msgspec.msgpack.decode(payload))
    return Record(
        topic=name, form=form, sequence=sequence, log_time_ns=log_time_ns, publish_time_ns=stamp_ns, data=data
    )


def gap_record(gap: Gap, *, sequence: int) -> Record:
    """A gap as a record of its own, in its place in the chain."""
    return Record(
        topic=GAP_TOPIC,
        form=json_form(Gap),
        sequence=sequence,
        log_time_ns=gap.until_ns,
        publish_time_ns=gap.until_ns,
        data=_JSON.encode(gap),
    )


def _timestamp(stamp_ns: int) -> Timestamp:
    return Timestamp(seconds=stamp_ns // 1_000_000_000, nanos=stamp_ns % 1_000_000_000)


def _picture(frame: CameraFrame, *, camera: str, stamp_ns: int) -> bytes:
    image = CompressedImage(timestamp=_timestamp(stamp_ns), frame_id=camera, data=frame.jpeg, format="jpeg")
    return bytes(image.SerializeToString())


def _line(line: ServiceLog, *, stamp_ns: int) -> bytes:
    fields = "".join(f" {name}={value}" for name, value in line.fields.items())
    log = Log(
        timestamp=_timestamp(stamp_ns),
        level=_LEVELS.get(line.level.lower(), Log.UNKNOWN),
        message=line.message + fields,
        name=line.service,
    )
    return bytes(log.SerializeToString())
