"""What a speed assistance shows and sounds (Regulation (EU) 2021/1958, Annex I), and the sign that stands beside a message."""

from typing import Literal

import msgspec

from proto.rules import LegalLimit
from proto.scene import Unit

Warning = Literal["none", "shown", "sounded"]
"""Of an overspeed: shown while it lasts, and sounded for some seconds of it."""
Face = Literal[
    "limit", "limit_advisory", "limit_ahead", "border", "stop", "give_way", "red_light", "green_light", "person",
    "vehicle", "slippery", "deep_water", "ice", "car_fault", "unclear_sign", "sign", "service_fault", "caution",
]  # fmt: skip
"""What a page draws: a closed list, whatever the words say."""


class Picture(msgspec.Struct, frozen=True, kw_only=True):
    """The sign to show beside a message."""

    face: Face
    value: float | None = None
    """The number on it, in the unit of the country."""
    unit: Unit | None = None
    country: str = ""
    """ISO 3166 alpha-3: whose sign it is; empty: unknown."""
    plate: str = ""
    """The condition below it, in the driver's words (`when wet`); empty: the sign has none."""


class SpeedAssistance(msgspec.Struct, frozen=True, kw_only=True):
    """The state of the speed assistance after a tick."""

    tick: int
    snapshot_stamp_ns: int
    speed_mps: float | None
    limit: LegalLimit | None
    """The limit in force; None: unknown, which has a sign of its own."""
    country: str = ""
    plate: str = ""
    target_mps: float | None = None
    """The target of this moment: a mark on the speed ring."""
    advised_mps: float | None = None
    """What road and weather ask for, where that is clearly less than the limit: a small number beside the sign."""
    warning: Warning = "none"
    excess_mps: float = 0.0
    """So much faster than the limit while an overspeed is shown; the driver's tolerance delays the sound alone."""
    muted: bool = False
    """The driver has switched sounds off for this drive."""
    fault: str = ""
    """Why the limit cannot be told, as the names of what is missing; empty: all is well."""

    @property
    def known(self) -> Literal["known", "assumed", "unknown"]:
        """How sure the limit is: as it stands, with a question mark, or crossed out."""
        if self.limit is None:
            return "unknown"
        return "assumed" if self.limit.assumed else "known"
