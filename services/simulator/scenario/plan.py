"""The fields of a scenario file: frozen structs, distances along the route in metres, times in seconds since the start."""

from typing import Annotated, Literal

import msgspec

from proto.decision import Language
from services.simulator.scene.scene import ActorKind

Positive = Annotated[float, msgspec.Meta(gt=0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
RoadClass = Literal["urban", "rural", "motorway"]
Country = Literal["DEU", "GBR", "AUT", "FRA", "NLD", "POL"]
Surroundings = Literal["fields", "forest", "houses", "town", "harbour"]


class _Plan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    pass


class PlacedPlan(_Plan, frozen=True, kw_only=True):
    """Anything that stands at a place along the route."""

    at_m: NonNegative


class BendPlan(_Plan, frozen=True, kw_only=True):
    """A piece of road: straight, or bent with a radius to one side."""

    length_m: Positive
    radius_m: Positive | None = None
    turn: Literal["left", "right"] = "left"


class StretchPlan(_Plan, frozen=True, kw_only=True):
    """What the road is like from here on."""

    from_m: NonNegative
    road_class: RoadClass
    surroundings: Surroundings
    pavement: bool = False
    lamps: bool = False
    parked: NonNegative = 0.0
    """Parked cars per 100 m at the near side."""


class RoadPlan(_Plan, frozen=True, kw_only=True):
    """The road: its course, lanes per direction, and where one changes over to the other side."""

    side: Literal["right", "left"] = "right"
    lanes: Annotated[int, msgspec.Meta(ge=1, le=3)] = 1
    lane_width_m: Annotated[float, msgspec.Meta(ge=2.75, le=4)] = 3.25
    median_m: NonNegative = 0.0
    changeover_m: Positive | None = None
    bends: Annotated[tuple[BendPlan, ...], msgspec.Meta(min_length=1)]
    stretches: Annotated[tuple[StretchPlan, ...], msgspec.Meta(min_length=1)]


class EgoPlan(_Plan, frozen=True, kw_only=True):
    """Where the ego starts."""

    at_m: NonNegative
    lane: Annotated[int, msgspec.Meta(ge=0, le=2)] = 0
    speed_kmh: NonNegative
    absent_mps2: Annotated[float, msgspec.Meta(ge=-5.0, le=3.0)] = 0.0
    """What an absent driver's foot asks for, all the time."""


class WeatherPlan(_Plan, frozen=True, kw_only=True):
    """The weather at one time; between two of them it changes evenly."""

    at_s: NonNegative
    rain_mm_h: NonNegative = 0.0
    visibility_m: Positive = 20_000.0
    air_c: float = 12.0
    cloud: Share = 0.5
    wind_mps: NonNegative = 2.0
    snow_mm_h: NonNegative = 0.0
    """As water."""
    gust_mps: NonNegative | None = None
    dew_point_c: float | None = None
    """Without it, somewhat below the air."""
    road_c: float | None = None
    """Without it, somewhat above the air."""
    lying_snow_mm: NonNegative = 0.0
    """What lies on the road at the start, as water; of the first time alone."""
    lying_ice_mm: NonNegative = 0.0
    lying_frost_mm: NonNegative = 0.0


class DaylightPlan(_Plan, frozen=True, kw_only=True):
    """The sun; below the horizon it is night."""

    sun_elevation_deg: Annotated[float, msgspec.Meta(ge=-20, le=90)] = 40.0
    sun_azimuth_deg: float = 120.0


class SignPlan(PlacedPlan, frozen=True, kw_only=True):
    """A post with faces, topmost first, for the ego's direction; `near` is the side on which one drives."""

    codes: Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=3)]
    text: str = ""
    country: Country | None = None
    """Whose style; without it the country one is in."""
    side: Literal["near", "far", "both"] = "near"


class LightPlan(PlacedPlan, frozen=True, kw_only=True):
    """Traffic lights with a stop line; `red_on_approach_m`: turns red when the ego first comes this near."""

    green_s: Positive = 18.0
    amber_s: Positive = 3.0
    red_s: Positive = 12.0
    red_amber_s: Positive = 1.0
    offset_s: NonNegative = 0.0
    red_on_approach_m: Positive | None = None
    side_road: bool = True


class StopPlan(PlacedPlan, frozen=True, kw_only=True):
    """A stop sign with its line, at a side road that has right of way."""


class CrossCarPlan(_Plan, frozen=True, kw_only=True):
    """A car that comes out of the side road and goes straight over, with right of way over the ego's road."""

    kind: ActorKind = "saloon"
    from_side: Literal["right", "left"] = "right"
    speed_kmh: Annotated[float, msgspec.Meta(gt=5, le=60)] = 28.0
    when_ego_within_m: Positive
    """Sets off when the ego's front is this near to the line."""
    halts_mps2: Annotated[float, msgspec.Meta(gt=0, le=6)] | None = None
    """Brakes so and halts a metre before the ego's road: it lets all traffic pass."""


class YieldPlan(PlacedPlan, frozen=True, kw_only=True):
    """A junction where the ego gives way: to those from the right, or with a sign to both sides."""

    sign: bool = False
    cars: tuple[CrossCarPlan, ...] = ()


class WaterPlan(_Plan, frozen=True, kw_only=True):
    """A place where water stands on the road."""

    from_m: NonNegative
    to_m: NonNegative
    film_mm: Annotated[float, msgspec.Meta(gt=0, le=30)]


class ZebraPlan(PlacedPlan, frozen=True, kw_only=True):
    """A pedestrian crossing with its signs."""


class PanelStep(_Plan, frozen=True, kw_only=True):
    """What a gantry shows from a time on."""

    at_s: NonNegative
    code: str
    lanes: tuple[str, ...] = ()
    """Lane signals instead of `code`, from the median outwards; "": the code. Never over the ego's lane."""


class GantryPlan(PlacedPlan, frozen=True, kw_only=True):
    """A gantry; it shows its programme, or less where `follow_traffic` and cars downstream are slow."""

    steps: Annotated[tuple[PanelStep, ...], msgspec.Meta(min_length=1)]
    follow_traffic: bool = True


class WalkersPlan(_Plan, frozen=True, kw_only=True):
    """People on the pavement between two places: walking, or waiting at the kerb."""

    from_m: NonNegative
    to_m: NonNegative
    count: Annotated[int, msgspec.Meta(ge=1, le=20)]
    side: Literal["near", "far", "both"] = "both"
    mode: Literal["walking", "waiting"] = "walking"


class CrosserPlan(PlacedPlan, frozen=True, kw_only=True):
    """A person who crosses: at a crossing when the plan says so, or stepping out as a hazard when the ego is within `when_ego_within_m`."""

    side: Literal["near", "far"] = "near"
    walks_up_m: Positive | None = None
    """Comes from so far behind the kerb and stops at it; None: waits at the kerb and crosses."""
    walk_mps: Annotated[float, msgspec.Meta(gt=0, le=4)] = 1.4
    when_ego_within_m: Positive | None = None
    at_s: NonNegative | None = None
    hazard: bool = False
    waits_for_light: bool = False
    """Starts when the lights nearby are red for cars."""


class HaltPlan(_Plan, frozen=True, kw_only=True):
    """A stop that a scripted vehicle makes."""

    at_m: NonNegative
    hold_s: NonNegative = 4.0
    brake_mps2: Annotated[float, msgspec.Meta(gt=0, le=8)] = 2.5
    hazard: bool = False


class LaneChangePlan(_Plan, frozen=True, kw_only=True):
    """A change of lane: in front of the ego, or out of its way."""

    to_lane: Annotated[int, msgspec.Meta(ge=0, le=2)]
    when_ego_at_m: NonNegative
    """When the ego's middle has come to this place."""
    paces_m: Positive | None = None
    """Until then it keeps this gap ahead of the ego (bumper to bumper); without it, it drives as it likes."""
    then_kmh: Positive | None = None
    """Drives no faster than this from then on."""
    at_gap_m: Positive | None = None
    """Waits with the change until the ego has come so near behind it; does not make it where that is much nearer."""
    hazard: bool = False


class VehiclePlan(PlacedPlan, frozen=True, kw_only=True):
    """A vehicle with a part of its own, for example a lead vehicle that stops."""

    kind: ActorKind = "saloon"
    lane: Annotated[int, msgspec.Meta(ge=0, le=2)] = 0
    direction: Literal["forward", "oncoming"] = "forward"
    speed_kmh: NonNegative
    keeps_kmh: Positive | None = None
    """The vehicle never drives faster than this; without it, as the law and its driver please."""
    heeds_limits: bool = True
    halts: tuple[HaltPlan, ...] = ()
    lane_change: LaneChangePlan | None = None
    stands_s: Positive | None = None
    """It stands in the way, a hazard once it is in sight, and drives on so long after the ego has come near."""


class QueuePlan(_Plan, frozen=True, kw_only=True):
    """A congestion tail in all forward lanes: crawling until it dissolves."""

    tail_m: NonNegative
    rows: Annotated[int, msgspec.Meta(ge=1, le=8)] = 4
    spacing_m: Annotated[float, msgspec.Meta(ge=8)] = 14.0
    speed_kmh: NonNegative = 8.0
    dissolves_s: Positive = 90.0


class TrafficPlan(_Plan, frozen=True, kw_only=True):
    """Cars that come and go: how many are kept around the ego, and how far apart."""

    forward: Annotated[int, msgspec.Meta(ge=0, le=24)] = 4
    oncoming: Annotated[int, msgspec.Meta(ge=0, le=24)] = 6
    gap_m: Annotated[float, msgspec.Meta(ge=20)] = 70.0
    lorries: Share = 0.12


class FaultPlan(_Plan, frozen=True, kw_only=True):
    """A fault of the car that begins during the drive; the presets stand in `car_faults.py`."""

    preset: str
    at_s: NonNegative = 0.0
    severity: Annotated[float, msgspec.Meta(gt=0, le=1)] = 1.0


class Scenario(_Plan, frozen=True, kw_only=True):
    """One scenario family; the seed varies drivers, looks, traffic and noise."""

    name: Annotated[str, msgspec.Meta(pattern="^[a-z0-9][a-z0-9-]{0,40}$")]
    about: str = ""
    country: Country
    driver_language: Language = "en"
    driver_country: Country = "GBR"
    duration_s: Positive = 60.0
    road: RoadPlan
    ego: EgoPlan
    weather: Annotated[tuple[WeatherPlan, ...], msgspec.Meta(min_length=1)]
    daylight: DaylightPlan = DaylightPlan()
    traffic: TrafficPlan = TrafficPlan()
    signs: tuple[SignPlan, ...] = ()
    lights: tuple[LightPlan, ...] = ()
    stops: tuple[StopPlan, ...] = ()
    yields: tuple[YieldPlan, ...] = ()
    zebras: tuple[ZebraPlan, ...] = ()
    water: tuple[WaterPlan, ...] = ()
    gantries: tuple[GantryPlan, ...] = ()
    walkers: tuple[WalkersPlan, ...] = ()
    crossers: tuple[CrosserPlan, ...] = ()
    vehicles: tuple[VehiclePlan, ...] = ()
    queues: tuple[QueuePlan, ...] = ()
    faults: tuple[FaultPlan, ...] = ()

    @property
    def length_m(self) -> float:
        """Length of the route."""
        return sum(bend.length_m for bend in self.road.bends)
