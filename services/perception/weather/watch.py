"""Reads the weather about once a second beside the detection, never before it: late pictures are skipped, not queued."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from proto.sensors import CameraFrame
from proto.weather import CameraWeather
from services.perception.checks.decoding import open_picture
from services.perception.range.camera import Camera
from services.perception.weather.camera_weather import NS, WeatherModel, WeatherWindow

Told = Callable[[CameraWeather, int], None]


class WeatherWatch:
    """Give it pictures of the primary camera after their boxes were published; `tell` gets the weather and the picture's stamp.

    `soon` runs a job on the service's own thread. Without it (lockstep) all is done at once, so that a drive repeats itself.
    """

    def __init__(self, model: WeatherModel, tell: Told, soon: Callable[[Callable[[], None]], None] | None) -> None:
        self._model, self._tell, self._soon = model, tell, soon
        self._windows: dict[str, WeatherWindow] = {}
        self._due_ns: dict[str, int] = {}
        self._busy: Future[dict[str, float] | None] | None = None
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="weather") if soon else None

    def offer(self, camera_id: str, stamp_ns: int, frame: CameraFrame, camera: Camera | None) -> None:
        """Take a picture that opens, if one is due; `camera` None: its calibration is unknown."""
        due_ns = self._due_ns.get(camera_id, stamp_ns)
        if due_ns - 2 * NS < stamp_ns < due_ns or (self._busy is not None and not self._busy.done()):
            return
        self._due_ns[camera_id] = stamp_ns + NS
        if camera is None:
            self._tell(CameraWeather(camera=camera_id, reasons=("the camera is not calibrated",)), stamp_ns)
        elif self._pool is None or self._soon is None:
            self._take(camera_id, stamp_ns, self._judge(frame, camera))
        else:
            soon, self._busy = self._soon, self._pool.submit(self._judge, frame, camera)
            self._busy.add_done_callback(lambda done: soon(lambda: self._take(camera_id, stamp_ns, done.result())))

    def close(self) -> None:
        """Wait for what is under way."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def _judge(self, frame: CameraFrame, camera: Camera) -> dict[str, float] | None:
        return self._model.judge(open_picture(frame), camera)

    def _take(self, camera_id: str, stamp_ns: int, judged: dict[str, float] | None) -> None:
        window = self._windows.setdefault(camera_id, WeatherWindow(self._model.card, camera_id))
        self._tell(window.add(stamp_ns, judged), stamp_ns)
