"""A scenario driven once and kept: every picture, sweep and map view with the truth, so that perception can see it again.

The driver drives alone, without advice. Rendering is by far the slowest part; a kept drive is seen again in seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np

from drivemcp.errors import MALFORMED, UserError
from drivemcp.paths import data
from evaluation.run.spec import RunSpec
from evaluation.run.world import world_of
from proto.sensors import CameraFrame, LidarSweep, MapView
from proto.truth import Truth
from proto.vehicle import Ego
from services.simulator.scenario.plan import Scenario
from services.simulator.session import CAMERAS, Batch, Session, Shot
from studies.tracking.cut_ins import CutIns
from training.labelling import Label, LabellingRenderer

JPEG_QUALITY = 85
EPOCH_NS = 1_000_000_000


class Look(msgspec.Struct, frozen=True, kw_only=True):
    """A camera's picture and what there is to be seen in it."""

    camera: str
    frame: CameraFrame
    labels: tuple[Label, ...]


class Step(msgspec.Struct, frozen=True, kw_only=True):
    """One step of the simulator."""

    stamp_ns: int
    ego: Ego
    truth: Truth
    sweep: LidarSweep | None = None
    map: MapView | None = None
    looks: tuple[Look, ...] = ()


class DriveName(msgspec.Struct, frozen=True, kw_only=True):
    """Which drive: the same name gives the same drive. `scenario`: by name, or a generated place (family/split/number).
    `cut_ins`: cars of the next lane are told to change into ours."""

    scenario: str
    seed: int
    seconds: float
    cut_ins: bool = False

    @property
    def file(self) -> str:
        """Under which it is kept."""
        return f"{self.scenario.replace('/', '_')}-{self.seed}-{self.seconds:g}{'-cut-ins' if self.cut_ins else ''}.msgpack"


def recording(name: DriveName, keep: Path | None = None) -> list[Step]:
    """The drive; from the folder `keep` where it lies there, else driven, and laid there. Raises UserError."""
    return kept(keep / name.file if keep is not None else None, lambda: record(name))


def kept(path: Path | None, drive: Callable[[], list[Step]]) -> list[Step]:
    """What lies there, else what is driven, which is laid there. Raises UserError."""
    if path is None:
        return drive()
    if path.exists():
        return _read(path)
    steps = drive()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.msgpack.encode(steps))
    return steps


def _read(path: Path) -> list[Step]:
    try:
        return msgspec.msgpack.decode(path.read_bytes(), type=list[Step])
    except MALFORMED as error:
        raise UserError(f"{path}: not a kept drive of this version ({error}); delete it to drive again") from error


def record(name: DriveName) -> list[Step]:
    """Drive and render. Raises ScenarioError, and RendererUnavailable where there is no OpenGL."""
    plan, seed = world_of(RunSpec(scenario=name.scenario, seed=name.seed))
    return drive_of(plan, seed, name.seconds, cut_ins=name.cut_ins)


def drive_of(plan: Scenario, seed: int, seconds: float, *, cut_ins: bool = False) -> list[Step]:
    """Drive and render a plan. Raises ScenarioError, and RendererUnavailable where there is no OpenGL."""
    session = Session(plan, seed, seconds=seconds, epoch_ns=EPOCH_NS, dbc=data("vehicles/sim/sim.dbc"), bus="car")
    renderer = LabellingRenderer(session.world.static, seed)
    steered = CutIns(session.world) if cut_ins else None
    steps = []
    while not session.finished:
        if steered is not None:
            steered.step()
        steps.append(_step(session.advance(), renderer))
    renderer.close()
    return steps


def _step(batch: Batch, renderer: LabellingRenderer) -> Step:
    ego = batch.snapshot.ego
    said: dict[type, Any] = {type(out.message): out.message for out in batch.messages}
    return Step(
        stamp_ns=batch.stamp_ns,
        ego=Ego(speed_mps=ego.speed_mps, yaw_rate_radps=ego.yaw_rate_radps),
        truth=said[Truth],
        sweep=said.get(LidarSweep),
        map=said.get(MapView),
        looks=tuple(_look(shot, renderer) for shot in batch.shots),
    )


def _look(shot: Shot, renderer: LabellingRenderer) -> Look:
    camera = CAMERAS[shot.camera]
    frame = coded(renderer.render(shot.scene, camera), shot.frame)
    return Look(camera=shot.camera, frame=frame, labels=tuple(renderer.render_labels(shot.scene, camera)))


def coded(picture: np.typing.NDArray[np.uint8], number: int) -> CameraFrame:
    """An RGB picture (H, W, 3) as a camera sends it."""
    settings = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    jpeg = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), settings)[1].tobytes()
    return CameraFrame(jpeg=jpeg, width_px=picture.shape[1], height_px=picture.shape[0], frame=number)
