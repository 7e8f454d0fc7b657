"""A body in the world: where it is and how big."""

from dataclasses import dataclass

from services.simulator.scene.scene import Actor, Pose


@dataclass(frozen=True, slots=True)
class Box:
    """A body that stands on the ground, in the world frame; `foot_m` is how high it begins."""

    pose: Pose
    length_m: float
    width_m: float
    height_m: float
    foot_m: float = 0.0

    @classmethod
    def of(cls, actor: Actor) -> "Box":
        """The body of a road user."""
        return cls(actor.pose, actor.length_m, actor.width_m, actor.height_m)
