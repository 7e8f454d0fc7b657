"""A truth with road users in it, and a recording of such."""

from evaluation.run.spec import RunSpec
from proto.perception import Boxes
from proto.truth import TrueActor, Truth
from studies.modelled_sensors.recording import Recording

NS = 1_000_000_000

SPEC = RunSpec(scenario="urb-rain", seed=3, seconds=2.5, sensors="model")


def truth(time_s: float, *actors: TrueActor, signs: tuple[dict[str, str | float], ...] = ()) -> Truth:
    return Truth(
        time_s=time_s, distance_m=20.0 * time_s, speed_mps=20.0, acceleration_mps2=0.0, law_limit_mps=None,
        jurisdiction="DEU", mu=0.8, gap_m=None, closing_mps=None, actors=actors, signs=signs, visibility_m=20_000.0,
        rain_mm_h=0.0, dark=False,
    )  # fmt: skip


def car(number: int, x_m: float, y_m: float = 0.0) -> TrueActor:
    return TrueActor(
        actor_id=number, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=0.0, vy_mps=0.0, length_m=4.6, width_m=1.82
    )


def drawn(truths: list[tuple[int, Truth]]) -> Recording:
    """A recording of pictures of the front camera at each truth, and of the tele camera at every other."""
    boxes = [(at, Boxes(camera="front", frame=k, boxes=())) for k, (at, _) in enumerate(truths)]
    boxes += [(at, Boxes(camera="tele", frame=k, boxes=())) for k, (at, _) in enumerate(truths[::2])]
    return Recording(spec=SPEC, truths=truths, boxes=boxes)
