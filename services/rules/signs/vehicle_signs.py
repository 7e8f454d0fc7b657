"""Signs that bind some classes of vehicle alone: which, and what they demand of them."""

import msgspec

from proto.rules import LegalAction, VehicleClass

_GOODS: tuple[VehicleClass, ...] = ("lorry_light", "lorry", "lorry_trailer")
_VANS: tuple[VehicleClass, ...] = ("van", "van_trailer")
_TRAILERS: tuple[VehicleClass, ...] = ("car_trailer", "van_trailer")
_LARGE: tuple[VehicleClass, ...] = (*_GOODS, *_VANS, "car_trailer", "bus", "coach")


class Binding(msgspec.Struct, frozen=True, kw_only=True):
    """Which vehicles a sign binds, and to which action."""

    action: LegalAction
    surely: tuple[VehicleClass, ...] = ()
    perhaps: tuple[VehicleClass, ...] = ()
    """By their mass, size or use, which are not known here, or by the law of some countries alone."""


_MEASURE = Binding(action="no_entry", perhaps=_LARGE)
BINDINGS: dict[str, Binding] = {
    "no_lorries": Binding(action="no_entry", surely=_GOODS, perhaps=_VANS),
    "no_overtaking_lorries": Binding(action="no_overtaking", surely=_GOODS, perhaps=_VANS),
    "led:no_overtaking_lorries": Binding(action="no_overtaking", surely=_GOODS, perhaps=_VANS),
    "no_lorry_right_lane": Binding(action="proceed_with_care", surely=_GOODS, perhaps=("bus", "coach", *_TRAILERS)),
    "no_buses": Binding(action="no_entry", surely=("bus", "coach")),
    "no_coaches": Binding(action="no_entry", surely=("coach",), perhaps=("bus",)),
    "no_trailers": Binding(action="no_entry", surely=("lorry_trailer",), perhaps=_TRAILERS),
    "no_car_trailers": Binding(action="no_entry", surely=("car_trailer",), perhaps=("van_trailer",)),
    "no_lorry_trailers": Binding(action="no_entry", surely=("lorry_trailer",), perhaps=("van_trailer",)),
    "no_caravans": Binding(action="no_entry", perhaps=_TRAILERS),
    "no_motorcycles": Binding(action="no_entry", surely=("motorcycle",)),
    "no_cars": Binding(action="no_entry", surely=("car", "car_snow_chains", "car_trailer"), perhaps=(*_GOODS, *_VANS, "bus", "coach")),
    "height_limit": _MEASURE,
    "width_limit": _MEASURE,
    "length_limit": _MEASURE,
    "weight_limit": _MEASURE,
    "axle_limit": _MEASURE,
}  # fmt: skip
"""By sign code, in every country: the packs state what a sign demands of a car."""
