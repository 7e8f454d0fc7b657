"""The fitted model as a file: every number of it, with where it comes from."""

import math
from pathlib import Path
from typing import Literal

import msgspec

from drivemcp.errors import MALFORMED, UserError
from proto.perception import ObjectClass
from proto.truth import Truth
from proto.weather import CameraWeather


class Line(msgspec.Struct, frozen=True, kw_only=True):
    """A linear function of what a thing and the weather are like; see `features`."""

    weights: tuple[float, ...]
    sigma: float = 0.0
    """Of what is left, where the function is of a measure; 0 where it is of log-odds."""
    memory_s: float = 0.3
    """Time in which what is left is forgotten; of log-odds, in which yes or no is: longer makes longer drop-outs at the
    same rate."""

    def at(self, features: tuple[float, ...]) -> float:
        """Its value."""
        return sum([weight * feature for weight, feature in zip(self.weights, features, strict=True)])


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """How often a picture has a box of a thing."""

    odds: Line
    """Log-odds of it."""
    own: float = 0.0
    """Standard deviation of the log-odds that are each thing's own, all its pictures and both cameras alike."""


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """How a camera's detector finds one class."""

    seen: Seen
    hidden: Seen
    """While it is hidden by half and more."""
    score: Line
    """Log-odds of the box's score."""
    height: Line
    """Logarithm of the box's height by the true one."""
    aside: Line
    """How far the box's middle is to the right of the true one, in true heights."""
    foot: Line
    """How far its lower edge is below the true one, in true heights."""
    pictures: int = 0
    things: int = 0


NEAREST_GHOST_M = 3.0
SPREADS = tuple(step / 5.0 for step in range(-16, 17))
"""Standard normal numbers: the places of quantiles, close together in the middle and far out alike."""


class RangeErrors(msgspec.Struct, frozen=True, kw_only=True):
    """How far measured ranges are off: (range - true) / true."""

    quantiles: tuple[float, ...]
    """At the shares below `SPREADS`."""
    own: float
    """Share of the variance of ranks that is each thing's own, for good."""
    memory_s: float
    """Time in which the rest is forgotten."""


class Ranging(msgspec.Struct, frozen=True, kw_only=True):
    """Where ranges come from and how far they are off, for one class in one camera."""

    lidar: Line
    """Log-odds that LiDAR measures the range of a box."""
    errors: dict[str, RangeErrors] = {}
    """By what hides the thing, see `regime_of`; empty where LiDAR measured none."""
    pictures: int = 0


class GhostBox(msgspec.Struct, frozen=True, kw_only=True):
    """What one picture had of it."""

    after_s: float
    """Since the first picture that had it."""
    driven_m: float
    """By the ego, since then."""
    step_m: float
    """Between that picture and the next."""
    turned_rad: float
    """By the ego, to the left, since the first picture that had it."""
    box: tuple[float, float, float, float]
    score: float
    range_m: float | None
    """By LiDAR; None: it measured none."""
    seen_through: bool = False
    """LiDAR measured what lies behind it."""


class Ghost(msgspec.Struct, frozen=True, kw_only=True):
    """A box that was of nothing, picture by picture: it is drawn again as it was.

    What deceives a moving camera mostly stands beside the road, so its boxes come by the way that the ego has gone since;
    before a standing one they come by time.
    """

    kind: ObjectClass
    boxes: tuple[GhostBox, ...]
    """In the order of time."""
    moving: bool
    """Whether the ego drove when it began."""


PACES_MPS = (1.0, 8.0, 16.0, 25.0, math.inf)
"""What a box of nothing does in the picture depends on how fast the ego goes: upper ends of speeds that are taken together."""


class Clutter(msgspec.Struct, frozen=True, kw_only=True):
    """Boxes of nothing in one camera's pictures, while the ego goes at one of `PACES_MPS` in one kind of surroundings."""

    per_minute: float
    ghosts: tuple[Ghost, ...]


Surroundings = Literal["built_up", "open"]
BUILT_UP_MPS = 16.0
"""A lower limit (50 km/h, 35 mph) is of a built-up road: posts, trees and parked cars deceive two to four times as often
there, at equal speed."""


def surroundings_of(limit_mps: float | None) -> Surroundings:
    """By the limit in force; `None`: no limit."""
    return "built_up" if limit_mps is not None and limit_mps < BUILT_UP_MPS else "open"


def pace_of(speed_mps: float) -> int:
    """Which of `PACES_MPS`."""
    return next(k for k, end in enumerate(PACES_MPS) if speed_mps < end)


class LooksLike(msgspec.Struct, frozen=True, kw_only=True):
    """What the pictures' weather was told to be when it really was so. `open_m`: true visibility."""

    weather: str
    open_m: float
    told: CameraWeather


class Reads(msgspec.Struct, frozen=True, kw_only=True):
    """A row of the reader's measured table: faces of at least `px` pixels."""

    px: float
    right: float
    sure_right: float
    sure_wrong: float


class Reading(msgspec.Struct, frozen=True, kw_only=True):
    """How faces are read, by class of face; from the reader's card, but for how faces differ."""

    rows: dict[str, tuple[Reads, ...]]
    taken_for_a_sign: float
    """Share of boxes of nothing that are surely read as a sign."""
    legible: float
    """How many pixels of a driven face count as one of the reader's own table."""
    alike: float
    """Share of the variance that is the face's own: all its pictures are read alike. The rest is each picture's."""
    sure: float
    unsure: float


class Card(msgspec.Struct, frozen=True, kw_only=True):
    """The whole model. `provenance`: runs, code, models and figures that it was fitted to."""

    found: dict[str, Finding]
    """`camera/class`."""
    ranged: dict[str, Ranging]
    """`camera/class`."""
    clutter: dict[str, dict[Surroundings, tuple[Clutter, ...]]]
    """By camera and surroundings, one for each of `PACES_MPS`."""
    reading: Reading
    weather: tuple[LooksLike, ...]
    provenance: dict[str, object] = {}


def read_card(path: Path) -> Card:
    """Read the file. Raises UserError where it is not a model of this version."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Card)
    except (OSError, *MALFORMED) as error:
        raise UserError(f"{path}: not a model of observations of this version ({error})") from error


def own_odds(odds: float, own: float, luck: float) -> float:
    """Log-odds of one thing, from those of its kind: things that differ by `own` must differ around steeper ones (a probit
    is steeper by the root of 1 plus the variance; 0.346 makes a logit of it). `luck`: the thing's standard normal number."""
    return odds * math.sqrt(1.0 + 0.346 * own * own) + own * luck


HALF_HIDDEN = 0.5


def features(log_px: float, hidden: float, cut: float, air: tuple[float, float, float]) -> tuple[float, ...]:
    """What lines are functions of: 1, the logarithm of the height in 20 px below and above that, the hidden share up to
    a half and beyond it, the cut share, and `air`.

    `air` is darkness (0 or 1), rain (in 10 mm/h) and fog (1 km by the visibility), the last two at most 5.
    """
    covered = min(hidden, HALF_HIDDEN), max(hidden - HALF_HIDDEN, 0.0)
    return (1.0, min(log_px, 0.0), max(log_px, 0.0), *covered, cut, *air)


FEATURES = ("one", "log_px_below", "log_px_above", "hidden", "much_hidden", "cut", "dark", "rain", "fog")
REGIMES = (*(f"{size} {what}" for size in ("large", "small") for what in ("free", "covered", "hidden")), "cut")
"""What a thing looks like, as far as its range is concerned: of small ones the picture cannot tell whose returns they are."""
LARGE_PX = 25.0


def regime_of(hidden: float, cut: float, full_height_px: float) -> str:
    """Cut by the picture's edge; else large or small, and hidden by half and more, covered by something, or free."""
    if cut > 0.02:
        return "cut"
    size = "large" if full_height_px >= LARGE_PX else "small"
    return f"{size} {'hidden' if hidden >= HALF_HIDDEN else 'covered' if hidden >= 0.05 else 'free'}"


def weather_name(truth: Truth) -> str:
    """The weather, in the classes that the camera distinguishes."""
    if truth.dark:
        return "dark_rain" if (truth.rain_mm_h or 0.0) > 0.1 else "dark"
    if (truth.rain_mm_h or 0.0) > 0.1:
        return "rain"
    return "wet" if (truth.film_mm or 0.0) > 0.03 else "dry"
