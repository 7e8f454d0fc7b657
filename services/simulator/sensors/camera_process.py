"""Cameras in a process of their own: scenes go in, JPEG pictures come out, so that drawing never holds up the world.

Software OpenGL keeps the interpreter's lock while it draws; in the simulator's own process every publication would wait
for it. One studio draws all cameras, one picture after the other, on one core.
"""

import multiprocessing
import os
import signal
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

from drivemcp.errors import DriveMcpError
from services.simulator.scene.scene import CameraSpec, Road, Scene, StaticWorld

JPEG_QUALITY = 88
OPEN_WITHIN_S = 60.0
_NOTHING = StaticWorld(road=Road())


class StudioError(DriveMcpError, RuntimeError):
    """Pictures cannot be made here; the message says what to install or what broke."""


@dataclass(frozen=True, slots=True)
class Order:
    """One picture wanted: which camera, of what, and the number by which it is known.

    After the wall-clock instant `until_ns` it is not drawn any more; 0: it is always drawn.
    """

    number: int
    camera: str
    scene: Scene
    until_ns: int = 0


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture made; no bytes are an error, which `trouble` describes."""

    number: int
    camera: str
    jpeg: bytes
    trouble: str = ""


class Studio:
    """The parent's side. Call it on one thread."""

    def __init__(self, cameras: Sequence[CameraSpec], seed: int, niceness: int = 0) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        specs = {camera.id: camera for camera in cameras}
        self._process = context.Process(target=_work, args=(theirs, specs, seed, niceness), daemon=True)
        self._process.start()
        theirs.close()
        self._waiting: set[int] = set()
        self._made: dict[int, Picture] = {}

    @property
    def waiting(self) -> int:
        """Orders not yet answered."""
        return len(self._waiting)

    def load(self, scene: Scene) -> None:
        """Show a scene's world; returns when every camera has drawn it once. Raises StudioError.

        Pictures still on order are of the world before, and are thrown away.
        """
        self._send(scene)
        reply: Picture | str = self._reply()
        while isinstance(reply, Picture):
            reply = self._reply()
        self._waiting.clear()
        self._made.clear()
        if reply:
            raise StudioError(reply)

    def _reply(self) -> Any:
        if not self._pipe.poll(OPEN_WITHIN_S):
            raise StudioError(f"the cameras were not ready within {OPEN_WITHIN_S:.0f} s")
        return self._receive()

    def order(self, order: Order) -> None:
        """Ask for a picture of a scene of the loaded world."""
        self._waiting.add(order.number)
        self._send(replace(order, scene=replace(order.scene, static=_NOTHING)))

    def take(self, number: int, wait_s: float = 0.0) -> Picture | None:
        """A picture if it is made (within the wait), or None. Raises StudioError when the studio is gone."""
        while number not in self._made and self._pipe.poll(wait_s if number in self._waiting else 0.0):
            picture = self._receive()
            self._waiting.discard(picture.number)
            self._made[picture.number] = picture
        return self._made.pop(number, None)

    def forget(self, number: int) -> None:
        """A picture that came too late is thrown away, now or when it comes."""
        self._made.pop(number, None)
        self._made = {key: picture for key, picture in self._made.items() if key > number}

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        self._process.join(2.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(2.0)

    def _send(self, what: object) -> None:
        try:
            self._pipe.send(what)
        except OSError as error:
            raise StudioError(f"the camera process is gone: {error}") from error

    def _receive(self) -> Any:
        try:
            return self._pipe.recv()
        except (EOFError, OSError) as error:
            raise StudioError("the camera process is gone") from error


def _work(pipe: Connection, cameras: Mapping[str, CameraSpec], seed: int, niceness: int) -> None:
    """The child: loads worlds, draws orders, ends when the parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent ends us
    os.environ.setdefault("LP_NUM_THREADS", "1")
    os.nice(niceness)
    import cv2

    cv2.setNumThreads(1)
    desk = _Desk(cameras, seed)
    while True:
        try:
            job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            pipe.send(desk.load(job) if isinstance(job, Scene) else desk.draw(job))
        except (BrokenPipeError, OSError):
            return


class _Desk:
    """The state of the child process."""

    def __init__(self, cameras: Mapping[str, CameraSpec], seed: int) -> None:
        self._cameras, self._seed = cameras, seed
        self._renderer: Any = None
        self._static = _NOTHING

    def load(self, scene: Scene) -> str:
        """Show a world and draw it once, because a first picture takes long; the reason why not, or nothing."""
        from services.simulator.render import Renderer, RendererUnavailable

        try:
            if self._renderer is None:
                self._renderer = Renderer(scene.static, self._seed)
            else:
                self._renderer.load(scene.static)
        except RendererUnavailable as error:
            return str(error)
        self._static = scene.static
        for camera in self._cameras.values():
            self._renderer.render(scene, camera)
        return ""

    def draw(self, order: Order) -> Picture:
        """One picture, encoded once."""
        import cv2

        if 0 < order.until_ns < time.time_ns():
            return Picture(order.number, order.camera, b"", "too late to be drawn")
        scene = replace(order.scene, static=self._static)
        rgb = self._renderer.render(scene, self._cameras[order.camera])
        done, jpeg = cv2.imencode(".jpg", rgb[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        trouble = "" if done else "the picture could not be encoded"
        return Picture(order.number, order.camera, jpeg.tobytes() if done else b"", trouble)
