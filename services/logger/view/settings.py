"""What the live view is told, and what it says back; needs none of the view's packages."""

from typing import Annotated, Literal

import msgspec

Port = Annotated[int, msgspec.Meta(ge=0, le=65535)]
Mode = Literal["off", "web", "file"]


class ViewSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The live view. Ports of 0 are chosen free. `bind` other than loopback shows the cameras to the network."""

    mode: Mode = "off"
    """`web`: a page; `file`: a recording."""
    bind: str = "127.0.0.1"
    """Address to listen on."""
    port: Port = 0
    """Of the recording stream; 0 takes a free one."""
    web_port: Port = 0
    """Of the page; 0 takes a free one."""
    image_hz: Annotated[float, msgspec.Meta(ge=0.0, le=1000.0)] = 5.0
    """Pictures a second and camera, 0: all; the log keeps them all."""
    memory_mb: Annotated[int, msgspec.Meta(ge=1, le=65_536)] = 200
    """What the viewer's server keeps for pages opened late."""
    recording: str = ""
    """Also, or in mode `file` only, write this .rrd file."""


class Said(msgspec.Struct, frozen=True, kw_only=True):
    """One line of the view's process on its standard output."""

    viewer: str = ""
    problem: str = ""


class Shown(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """One record on its way to the view: topic as the table has it, name with the id, stamp, data as logged."""

    topic: str
    name: str
    stamp_ns: int
    data: bytes
