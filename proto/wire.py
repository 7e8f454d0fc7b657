"""The attachment of every publication, and the step protocol of lockstep."""

import msgspec

from proto import PROTO_VERSION


class PubHead(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """Number, stamps and origin of one publication. `epoch` tells a restarted publisher from a gap."""

    seq: int
    stamp_ns: int
    sent_ns: int
    publisher: str
    epoch: int
    major: int = PROTO_VERSION[0]


class StepRequest(msgspec.Struct, frozen=True, kw_only=True):
    """One simulated step: the time, and the last number of every key published on since the service's last step."""

    step: int
    now_ns: int
    published: dict[str, int]
    report_only: bool = False


class StepReply(msgspec.Struct, frozen=True, kw_only=True):
    """A service has done its step: what it has published since the last reply, and whose tools it has called."""

    service: str
    published: dict[str, int]
    error: str = ""
    called: tuple[str, ...] = ()
