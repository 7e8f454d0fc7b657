"""A recorded log as a bus: at its own pace by the node's clock, faster, looped, or step by step."""

import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import msgspec

from drivemcp.errors import ToolFailed
from drivemcp.files.can_logs.log import CanLog, Record
from proto.sensors import CanFrame
from services.can.buses.link import FrameLink, OnFrames
from services.can.errors import LinkDown

if TYPE_CHECKING:
    from drivemcp.node import Node

Steps = Annotated[int, msgspec.Meta(ge=1, le=10_000, description="number of steps", examples=[10])]
BusName = Annotated[str, msgspec.Meta(description="a recorded bus; without: the first", examples=["main"])]
NS = 1_000_000_000
PERIOD_S = 0.01
LOOP_GAP_S = 0.01
"""Between the last frame of a log and its first when it is looped."""
BATCH_LIMIT = 2000
"""Frames handed over at once: a log replayed too fast falls behind, and does not starve the service."""


class Step(msgspec.Struct, frozen=True, kw_only=True):
    """How far one step goes: so many frames, or so much recorded time."""

    frames: int = 0
    ms: float = 0.0


class StepAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """What one or several steps replayed: frames, seconds of the log behind it now, and whether the log has ended."""

    bus: str
    frames: int
    position_s: float
    ended: bool


class Replay:
    """Frames of a log in time. The clock is passed in; stamps are the clock's, a log's own only give the distances."""

    def __init__(self, log: CanLog, *, speed: float = 1.0, loop: bool = False) -> None:
        self.log, self._speed, self._loop = log, speed, loop
        self._records: Iterator[Record] = iter(log)
        self._next: Record | None = None
        self._base_s = 0.0
        self._start_ns: int | None = None
        self._last_ns = 0
        self.played = self._of_this_pass = 0
        self.position_s = 0.0
        self.ended = False
        self._take()

    def due(self, now_ns: int) -> list[CanFrame]:
        """The frames whose time has come, stamped when it came."""
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        found: list[CanFrame] = []
        while self._next is not None and len(found) < BATCH_LIMIT:
            stamp_ns = self._start_ns + self._span_ns(self._at_s())
            if stamp_ns > now_ns:
                break
            found.append(self._stamped(stamp_ns))
        return found

    def step(self, step: Step, now_ns: int) -> list[CanFrame]:
        """The frames of one step; the last moment of the step is now."""
        until_s = self.position_s + step.ms / 1000
        times: list[float] = []
        frames: list[CanFrame] = []
        while self._next is not None and (len(frames) < step.frames if step.frames else self._at_s() <= until_s):
            times.append(self._at_s())
            frames.append(self._stamped(0))
        ends_s = times[-1] if step.frames and times else until_s
        self.position_s = ends_s
        return [
            msgspec.structs.replace(frame, stamp_ns=self._not_before(now_ns - self._span_ns(ends_s - at_s)))
            for frame, at_s in zip(frames, times, strict=True)
        ]

    def _at_s(self) -> float:
        return self._base_s + (self._next.at_s if self._next is not None else 0.0)

    def _span_ns(self, span_s: float) -> int:
        return int(span_s / self._speed * NS)

    def _not_before(self, stamp_ns: int) -> int:
        self._last_ns = max(self._last_ns, stamp_ns)
        return self._last_ns

    def _stamped(self, stamp_ns: int) -> CanFrame:
        assert self._next is not None
        frame = msgspec.structs.replace(self._next.frame, stamp_ns=stamp_ns)
        self.position_s = self._at_s()
        self.played += 1
        self._of_this_pass += 1
        self._take()
        return frame

    def _take(self) -> None:
        """Look at the next record; at the end of a log that is looped, at its first again."""
        self._next = next(self._records, None)
        if self._next is None and self._loop and self._of_this_pass:
            self._base_s = self.position_s + LOOP_GAP_S
            self._of_this_pass = 0
            self._records = iter(self.log)
            self._next = next(self._records, None)
        self.ended = self._next is None


class ReplayLink:
    """A bus that only tells: a recording."""

    def __init__(self, replay: Replay, step: Step | None, node: "Node") -> None:
        self._replay, self._step, self._node = replay, step, node
        self._lock = threading.Lock()
        self._on_frames: OnFrames = lambda frames: None
        self._told = 0

    @property
    def state(self) -> str:
        """How far the replay is, and what of the log it could not read."""
        replay = self._replay
        doing = "ended" if replay.ended else "stepped" if self._step is not None else "replaying"
        said = f"{doing} {replay.log.path.name}: {replay.played} frames, {replay.position_s:.2f} s"
        return "; ".join(filter(None, (said, replay.log.summary)))

    def listen(self, on_frames: OnFrames) -> None:
        """Start, or be ready to be stepped. In lockstep every step of the clock is a step."""
        self._on_frames = on_frames
        if self._step is None:
            self._node.every(PERIOD_S, lambda: self._deliver(self._replay.due(self._node.clock.now_ns())))
        elif self._node.lockstep:
            self._node.every(0.001, lambda: self._deliver(self._stepped()))

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Raises LinkDown: a recording has no unit that could answer."""
        raise LinkDown(f"{self._replay.log.path.name} is a recording: it answers nothing")

    @property
    def stepped(self) -> bool:
        """Whether it waits to be told to go on."""
        return self._step is not None and not self._node.lockstep

    def advance(self, steps: int) -> tuple[int, float, bool]:
        """So many steps: frames replayed, seconds of the log behind it, and whether the log has ended."""
        with self._lock:
            frames = [frame for _ in range(steps) for frame in self._stepped()]
            self._node.run_soon(lambda: self._deliver(frames))
            return len(frames), round(self._replay.position_s, 6), self._replay.ended

    def _stepped(self) -> list[CanFrame]:
        return self._replay.step(self._step or Step(frames=1), self._node.clock.now_ns())

    def _deliver(self, frames: Sequence[CanFrame]) -> None:
        for note in self._replay.log.notes[self._told :]:
            self._node.log.warning("%s", note)
            self._told += 1
        if frames:
            self._on_frames(frames)


def offer(node: "Node", links: Mapping[str, FrameLink]) -> None:
    """Offer the stepping of those recordings that are stepped by calls, if there are any."""
    stepped = {name: link for name, link in links.items() if isinstance(link, ReplayLink) and link.stepped}
    if not stepped:
        return

    @node.tool(deadline_ms=200, read_only=False, idempotent=False)
    def step_recording(steps: Steps = 1, bus: BusName = "") -> StepAnswer:
        """Replay the next steps of a recorded bus; without a name, of the first that is stepped."""
        name = bus or next(iter(stepped))
        if name not in stepped:
            raise ToolFailed(
                f"no stepped recording on bus {name[:40]!r}", field="bus", do=f"take one of {', '.join(stepped)}"
            )
        frames, position_s, ended = stepped[name].advance(steps)
        return StepAnswer(bus=name, frames=frames, position_s=position_s, ended=ended)
