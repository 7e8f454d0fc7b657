"""The profiles of real cars against the public descriptions of those cars (opendbc, for tests only)."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from drivemcp.paths import data
from proto.sensors import CanFrame
from proto.vehicle import Ego
from services.can.ego import read_ego
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile, find_descriptions, load_profile
from services.can.signals.board import Board
from services.weather.assess import assess
from services.weather.memory import Memory
from services.weather.road.car import Car as WeatherCar
from services.weather.senses import from_car

if find_spec("opendbc") is None:
    pytest.skip(
        "opendbc is not installed: pip install drivemcp[dev] brings the public descriptions", allow_module_level=True
    )

from opendbc.can.packer import CANPacker

NOW = 1_000_000_000_000
PACKED_BY = {
    "vw_golf7": "vw_mqb",
    "tesla_model3": "tesla_model3_party",
    "ford_fusion": "ford_lincoln_base_pt",
    "toyota_rav4": "toyota_nodsu_pt_generated",
}
"""Profile -> the description by which opendbc packs this car's frames, counters and checksums included."""
CARS = tuple(PACKED_BY)
Signals = dict[str, dict[str, float]]


class Car:
    """A profile with its description, and a bus that carries what a test says."""

    def __init__(self, name: str) -> None:
        path = data(f"vehicles/{name}/profile.toml")
        self.profile: Profile = load_profile(path)
        self.files: dict[str, tuple[Path, ...]] = find_descriptions(self.profile, path)
        self.descriptions = {bus: Dbc(*files) for bus, files in self.files.items()}
        self.bus, self.dbc = next(iter(self.descriptions.items()))
        self.messages: dict[str, Any] = {}
        for message in self.dbc.messages.values():
            self.messages.setdefault(message.name, message)
        self.packer = CANPacker(PACKED_BY[name])

    def frame(self, name: str, signals: dict[str, float]) -> CanFrame:
        arbitration_id, payload, _ = self.packer.make_can_msg(name, 0, signals)
        extended = self.messages[name].is_extended_frame
        return CanFrame(stamp_ns=NOW, arbitration_id=arbitration_id, data=payload, extended=extended)

    def board(self, traffic: Signals) -> Board:
        board = Board(self.descriptions, self.profile)
        board.ingest([self.frame(name, signals) for name, signals in traffic.items()], NOW, self.bus)
        return board


@pytest.fixture(scope="module")
def cars() -> dict[str, Car]:
    return {name: Car(name) for name in CARS}


VW: Signals = {
    "ESP_21": {"ESP_v_Signal": 90.0, "ABS_Bremsung": 1},
    "ESP_02": {"ESP_Laengsbeschl": -4.0, "ESP_Querbeschleunigung": 0.2, "ESP_Gierrate": 9.0, "ESP_VZ_Gierrate": 1},
    "LWI_01": {"LWI_Lenkradwinkel": 45.0, "LWI_VZ_Lenkradwinkel": 1},
    "ESP_05": {"ESP_Bremsdruck": 30.0, "ESP_Fahrer_bremst": 1},
    "ESP_19": {f"ESP_{each}_Radgeschw_02": 90.0 for each in ("VL", "VR", "HL", "HR")},
    "Licht_Anf_01": {"BCM1_Standlicht_Anf": 1, "BCM1_Abblendlicht_Anf": 1},
    "Gateway_72": {"Wischer_vorne_aktiv": 1, "BCM1_Aussen_Temp_ungef": -3.5},
    "Blinkmodi_02": {"Comfort_Signal_Right": 1},
}
TESLA: Signals = {
    "DI_speed": {"DI_vehicleSpeed": 90.0},
    "EPAS3S_sysStatus": {"EPAS3S_internalSAS": 36.0, "EPAS3S_internalSASQF": 1},
    "ESP_status": {"ESP_driverBrakeApply": 2, "ESP_stabilityControlSts2": 2, "ESP_absBrakeEvent2": 2},
    "DI_systemStatus": {"DI_accelPedalPos": 40.0, "DI_gear": 4},
    "ESP_wheelSpeeds": {f"ESP_wheelSpeed{each}": 90.0 for each in ("FrL", "FrR", "ReL", "ReR")},
    "UI_warning": {"leftBlinkerBlinking": 2},
}
FORD: Signals = {
    "BrakeSysFeatures": {"Veh_V_ActlBrk": 90.0, "VehVActlBrk_D_Qf": 3},
    "Accel_Data_FD1": {"VehLong2_A_Actl": -4.0, "VehLat2_A_Actl": 2.0, "VehLongAActl_D_Qf": 3, "VehLatAActl_D_Qf": 3},
    "Yaw_Data_FD1": {"VehYaw_W_Actl": 0.16, "VehYawWActl_D_Qf": 3},
    "SteeringPinion_Data": {"StePinComp_An_Est": 45.0, "StePinCompAnEst_D_Qf": 3},
    "WheelSpeed": {f"Whl{each}_W_Meas": 25.0 / 0.33 for each in ("Fl", "Fr", "Rl", "Rr")},
    "Steering_Data_FD1": {"WiprFront_D_Stat": 6, "TurnLghtSwtch_D_Stat": 1},
    "EngineClimateData": {"AirAmb_Te_ActlFilt": -3.5, "AirAmbTe_D_Qf": 3},
    "BCM_Lamp_Stat_FD1": {"HeadLampLoActv_B_Stat": 1},
    "Tire_Pressure_Data_FD1": {f"Tire_Press_{each}_Data": 240 for each in ("LF", "RF", "LR_OLR", "RR_ORR")},
}
TOYOTA: Signals = {
    "SPEED": {"SPEED": 90.0},
    "KINEMATICS": {"YAW_RATE": 9.0, "ACCEL_X": -4.0, "ACCEL_Y": 2.0},
    "STEER_ANGLE_SENSOR": {"STEER_ANGLE": 45.0, "STEER_FRACTION": 0.5},
    "WHEEL_SPEEDS": {f"WHEEL_SPEED_{each}": 90.0 for each in ("FL", "FR", "RL", "RR")},
    "BLINKERS_STATE": {"TURN_SIGNALS": 2},
    "LIGHT_STALK": {"HEADLIGHT_MODE": 4},
}
EXPECTED: list[tuple[str, Signals, dict[str, object]]] = [
    (
        "vw_golf7",
        VW,
        {
            "speed_mps": 25.0,
            "acceleration_mps2": -4.0,
            "yaw_rate_radps": -0.157,
            "steering_angle_rad": -0.0503,
            "brake_pressure_bar": 30.0,
            "outside_temperature_c": -3.5,
            "abs_active": True,
            "wiper_stage": 3,
            "lamps_on": True,
            "indicator": "right",
        },
    ),
    (
        "tesla_model3",
        TESLA,
        {
            "speed_mps": 25.0,
            "steering_angle_rad": -0.0524,
            "accelerator_pedal": 0.4,
            "esc_active": True,
            "abs_active": True,
            "indicator": "left",
        },
    ),
    (
        "ford_fusion",
        FORD,
        {
            "speed_mps": 25.0,
            "acceleration_mps2": -4.0,
            "yaw_rate_radps": 0.16,
            "steering_angle_rad": 0.0531,
            "outside_temperature_c": -3.5,
            "wiper_stage": 3,
            "lamps_on": True,
            "indicator": "left",
        },
    ),
    (
        "toyota_rav4",
        TOYOTA,
        {
            "speed_mps": 25.0,
            "acceleration_mps2": -4.0,
            "yaw_rate_radps": 0.157,
            "steering_angle_rad": 0.0555,
            "lamps_on": True,
            "indicator": "right",
        },
    ),
]


@pytest.mark.parametrize("name", CARS)
def test_every_signal_that_a_profile_names_is_in_the_public_description(cars: dict[str, Car], name: str) -> None:
    car = cars[name]
    board = Board(car.descriptions, car.profile)
    assert set(board.fields) == set(car.profile.fields)
    assert {"speed_mps", "steering_angle_rad", "wheel_fl_mps", "indicator_left"} <= set(board.fields)


@pytest.mark.parametrize(("name", "traffic", "expected"), EXPECTED)
def test_known_values_on_the_bus_are_the_ego_with_unit_and_sign(
    cars: dict[str, Car], name: str, traffic: Signals, expected: dict[str, object]
) -> None:
    ego = read_ego(cars[name].board(traffic), NOW)
    for field, value in expected.items():
        wanted = pytest.approx(value, rel=0.02) if isinstance(value, float) else value
        assert getattr(ego, field) == wanted, field
    assert set(ego.invalid) == set()


def test_a_car_that_tells_no_more_than_that_it_wipes_vouches_for_no_light_rain(cars: dict[str, Car]) -> None:
    def counted_on(ego: Ego) -> float:
        driven = WeatherCar(speed_mps=ego.speed_mps)
        return assess((from_car(ego, None, NOW),), driven, Memory(), NOW).conditions.mu_low

    warm = {"Gateway_72": {"Wischer_vorne_aktiv": 1, "BCM1_Aussen_Temp_ungef": 15.0}}
    ego = read_ego(cars["vw_golf7"].board({**VW, **warm}), NOW)
    assert ego.wiper_stage is not None
    assert counted_on(ego) <= counted_on(structs.replace(ego, wiper_stage=None))


@pytest.mark.parametrize(
    ("name", "message", "signals", "field"),
    [
        ("vw_golf7", "ESP_21", {"ESP_v_Signal": 655.0}, "speed_mps"),
        ("vw_golf7", "ESP_21", {"ESP_v_Signal": 90.0, "ESP_QBit_v_Signal": 1}, "speed_mps"),
        ("tesla_model3", "DI_speed", {"DI_vehicleSpeed": 4095 * 0.08 - 40}, "speed_mps"),
        ("tesla_model3", "EPAS3S_sysStatus", {"EPAS3S_internalSAS": 36.0}, "steering_angle_rad"),
        ("ford_fusion", "Accel_Data_FD1", {"VehLong2_A_Actl": 41.89, "VehLongAActl_D_Qf": 3}, "acceleration_mps2"),
        ("ford_fusion", "Yaw_Data_FD1", {"VehYaw_W_Actl": 0.1, "VehYawWActl_D_Qf": 1}, "yaw_rate_radps"),
        ("toyota_rav4", "KINEMATICS", {"YAW_RATE": 124.0}, "yaw_rate_radps"),
    ],
)
def test_what_is_implausible_or_not_vouched_for_is_unknown_and_named(
    cars: dict[str, Car], name: str, message: str, signals: dict[str, float], field: str
) -> None:
    board = cars[name].board({message: signals})
    assert board.read(field, NOW).value is None
    assert field in read_ego(board, NOW).invalid


GUARDED = [
    ("vw_golf7", "ESP_21", "speed_mps"),
    ("vw_golf7", "ESP_02", "yaw_rate_radps"),
    ("vw_golf7", "LWI_01", "steering_angle_rad"),
    ("vw_golf7", "ESP_05", "brake_pressure_bar"),
    ("vw_golf7", "Motor_20", "accelerator_pedal"),
    ("vw_golf7", "Getriebe_11", "gear"),
    ("vw_golf7", "Licht_Anf_01", "headlamps"),
    ("tesla_model3", "DI_speed", "speed_mps"),
    ("tesla_model3", "EPAS3S_sysStatus", "steering_assist_fault"),
    ("tesla_model3", "ESP_status", "abs_fault"),
    ("tesla_model3", "DI_systemStatus", "accelerator_pedal"),
    ("tesla_model3", "DI_state", "parking_brake"),
    ("tesla_model3", "ESP_wheelSpeeds", "wheel_fl_mps"),
    ("tesla_model3", "IBST_status", "brake_booster_fault"),
    ("tesla_model3", "UI_warning", "indicator_left"),
    ("toyota_rav4", "SPEED", "speed_mps"),
]


@pytest.mark.parametrize(("name", "message", "field"), GUARDED)
def test_frames_that_opendbc_packs_are_believed_and_none_with_a_flipped_bit(
    cars: dict[str, Car], name: str, message: str, field: str
) -> None:
    """With every value of the counter, which chooses the data id, and every bit."""
    car = cars[name]
    board = Board(car.descriptions, car.profile)
    traffic = next(each for car_name, each, _ in EXPECTED if car_name == name)
    for frame in [car.frame(message, traffic.get(message, {})) for _ in range(16)]:
        bits = int.from_bytes(frame.data, "little")
        for place in range(8 * len(frame.data)):
            changed = (bits ^ 1 << place).to_bytes(len(frame.data), "little")
            board.ingest([structs.replace(frame, data=changed)], NOW, car.bus)
            assert board.read(field, NOW).reason == "wrong checksum"
        board.ingest([frame], NOW, car.bus)
        assert board.read(field, NOW).reason in ("", "not a known value")


def test_every_checksum_that_a_profile_declares_is_tried(cars: dict[str, Car]) -> None:
    declared = {(name, each) for name in CARS for each, rule in cars[name].profile.messages.items() if rule.checksum}
    assert declared == {(name, message) for name, message, _ in GUARDED}


@pytest.mark.parametrize(("speaker", "listener"), [(a, b) for a in CARS for b in CARS if a != b])
def test_frames_of_another_car_give_nothing_that_was_meant_for_this_one(
    cars: dict[str, Car], speaker: str, listener: str
) -> None:
    """Ids that both cars use for different things may be heard; all others leave every field unseen."""
    traffic = next(each for name, each, _ in EXPECTED if name == speaker)
    own = {message.frame_id for message in cars[listener].messages.values()}
    frames = [cars[speaker].frame(name, signals) for name, signals in traffic.items()]
    foreign = [frame for frame in frames if frame.arbitration_id not in own]
    board = Board(cars[listener].descriptions, cars[listener].profile)
    board.ingest(foreign, NOW, cars[listener].bus)
    assert foreign
    assert not [name for name, field in board.fields.items() if field.seen]
