"""What may stand in for a service."""

from typing import Literal

StandIn = Literal["truth", "sound_car"]
"""`truth`: actors and key facts from truth in place of those perceived. `sound_car`: the car says that nothing ails it."""
