"""Fault scenarios: each changes the car's state, sets its trouble codes and lights its lamps, so that frames,
diagnostics and driving agree.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from services.simulator.car_state import CarState, Four

OVERHEAT_GOAL_C = 132.0
OVERHEAT_C_PER_S = 4.0


@dataclass(frozen=True, slots=True)
class Fault:
    """One scenario. `change` gives the state after the fault has been there for some seconds."""

    preset: str
    routine: int
    """Identifier by which the test unit is asked for it (ISO 14229 RoutineControl)."""
    description: str
    codes: tuple[str, ...]
    lamps: frozenset[str]
    change: Callable[[CarState, float], CarState]
    brake_share: float = 1.0
    """Share of the sound car's braking deceleration that is left."""


def _hot(state: CarState, active_s: float) -> CarState:
    risen = min(OVERHEAT_GOAL_C, state.coolant_temperature_c + OVERHEAT_C_PER_S * active_s)
    return replace(state, coolant_temperature_c=risen, oil_temperature_c=state.oil_temperature_c + (risen - 90.0) * 0.5)


def _no_abs(state: CarState, active_s: float) -> CarState:
    return replace(state, abs_fault=True, esc_fault=True, abs_active=False, esc_active=False)


def _empty(state: CarState, active_s: float) -> CarState:
    return replace(state, fuel_share=min(state.fuel_share, 0.04))


def _soft(state: CarState, active_s: float) -> CarState:
    """The rear right tyre loses 0.1 bar a second down to 1.3 bar."""
    front_left, front_right, rear_left, rear_right = state.tyre_pressure_bar
    pressures: Four = (front_left, front_right, rear_left, max(1.3, rear_right - 0.1 * active_s))
    return replace(state, tyre_pressure_bar=pressures)


FAULTS: Mapping[str, Fault] = {
    fault.preset: fault
    for fault in (
        Fault("overheat", 0xF001, "The engine overheats", ("P0217",), frozenset({"coolant", "engine"}), _hot),
        Fault(
            "abs_fault",
            0xF002,
            "A wheel speed sensor fails: no anti-lock, no stability control; locked wheels slide",
            ("C0035",),
            frozenset({"abs", "stability"}),
            _no_abs,
            brake_share=0.75,
        ),
        Fault("low_fuel", 0xF003, "The tank is nearly empty", ("P0462",), frozenset({"fuel"}), _empty),
        Fault(
            "low_tyre",
            0xF004,
            "The rear right tyre loses air",
            ("C0765",),
            frozenset({"tyre"}),
            _soft,
            brake_share=0.9,
        ),
    )
}
CLEAR_ROUTINE = 0xF000
BY_ROUTINE: Mapping[int, Fault] = {fault.routine: fault for fault in FAULTS.values()}


def apply(state: CarState, active_s: Mapping[str, float]) -> CarState:
    """`state` under the active faults (preset -> seconds since it began)."""
    codes, lamps = list(state.stored_codes), state.lamps
    for preset, seconds in active_s.items():
        fault = FAULTS[preset]
        state = fault.change(state, seconds)
        codes += [code for code in fault.codes if code not in codes]
        lamps |= fault.lamps
    return replace(state, stored_codes=tuple(codes), lamps=lamps)


def brake_share(presets: Mapping[str, float]) -> float:
    """What the active faults leave of braking, together."""
    share = 1.0
    for preset in presets:
        share *= FAULTS[preset].brake_share
    return share
