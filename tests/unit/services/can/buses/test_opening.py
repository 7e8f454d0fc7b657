"""Which buses a configuration may name, and what is told of one that cannot be opened."""

import json
import re
from typing import Any

import can
import pytest

from drivemcp.config import load_config
from drivemcp.errors import ConfigError
from drivemcp.paths import data
from drivemcp.testing import bus
from proto import topics
from services.can.buses.opening import BusConfig
from services.can.service import SERVICE, CanConfig
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder


@pytest.mark.parametrize(
    ("buses", "complaint"),
    [
        ([{"interface": "telepathy"}], r"buses\[0\].interface: python-can knows no 'telepathy'; there are .*socketcan"),
        ([{"interface": "socketcan", "channel": "vcan99"}], r"buses\[0\]: cannot open socketcan vcan99: "),
        ([{"interface": "pcan", "bitrate": 500000}], r"buses\[0\]: cannot open pcan can0: "),
        ([{"interface": "vector", "channel": 0}], r"buses\[0\]: cannot open vector "),
        ([{"interface": "virtual", "options": {"receive_own_messages": "what", "protocol": 3}}], None),
        ([{}, {}], r"buses\[1\].name: there are two buses named 'can0'"),
        ([{}, {"name": "chassis"}], r"buses\[1\].name: the profile has no bus 'chassis'; it has can0"),
        ([], r"buses: the list is empty"),
    ],
)
def test_a_bus_that_cannot_be_is_told_in_one_line_naming_the_field(buses: list[Any], complaint: str | None) -> None:
    config = load_config(CanConfig, None, [f"buses={json.dumps(buses)}"])
    with bus() as b:
        if complaint is None:
            b.start(SERVICE, config)
            return
        with pytest.raises(ConfigError, match=complaint) as caught:
            b.start(SERVICE, config)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ('buses=[{"bitrate": 0}]', r"bitrate|>= 1"),
        ('buses=[{"name": "a/b"}]', r"name"),
        ('buses=[{"bitrat": 5}]', r"bitrat"),
    ],
)
def test_a_wrong_setting_is_named(setting: str, complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        load_config(CanConfig, None, [setting])


def test_control_units_are_asked_on_a_bus_that_there_is() -> None:
    with (
        bus() as b,
        pytest.raises(ConfigError, match=re.escape("diagnostics_bus: there is no bus 'body'; there are can0")),
    ):
        b.start(SERVICE, CanConfig(diagnostics_bus="body"))


def test_each_bus_of_a_car_feeds_its_own_fields(tmp_path: Any) -> None:
    profile = _profile_of_two_buses(tmp_path)
    buses = (
        BusConfig(name="drive", interface="virtual", channel="drive"),
        BusConfig(name="body", interface="virtual", channel="body"),
    )
    encoder, state = (
        FrameEncoder(data("vehicles/sim/sim.dbc")),
        CarModel().step(0.02, Controls(speed_mps=11.0, wiper_stage=1)),
    )
    with (
        bus() as b,
        can.Bus(interface="virtual", channel="drive") as drive,
        can.Bus(interface="virtual", channel="body") as body,
    ):
        b.start(SERVICE, CanConfig(buses=buses, profile=profile))
        egos = b.collect(topics.EGO)
        for _ in range(5):
            drive.send(_message(encoder.encode("Body", state)))  # the wrong bus for it
            drive.send(_message(encoder.encode("Motion", state)))
        ego = egos.wait(lambda ego: ego.speed_mps is not None)
        assert ego.wiper_stage is None
        for _ in range(5):
            body.send(_message(encoder.encode("Body", state)))
        ego = egos.wait(lambda ego: ego.wiper_stage is not None)
    assert ego.wiper_stage == 1


def _profile_of_two_buses(folder: Any) -> str:
    dbc = data("vehicles/sim/sim.dbc")
    (folder / "sim.dbc").write_bytes(dbc.read_bytes())
    path = folder / "profile.toml"
    path.write_text(
        'name = "two"\n[buses.drive]\ndescription = "sim.dbc"\n[buses.body]\ndescription = "sim.dbc"\n'
        "[vehicle]\ntyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]\n[fields]\n"
        'speed_mps = { vss = "Vehicle.Speed", bus = "drive", signal = "VehicleSpeed", unit = "m/s", maximum = 83.4, max_age_s = 60.0 }\n'
        'wiper_stage = { vss = "Vehicle.Body.Windshield.Front.Wiping.Mode", bus = "body", '
        'signal = "WiperStage", maximum = 3, max_age_s = 60.0 }\n'
    )
    return str(path)


def _message(frame: Any) -> can.Message:
    return can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False)
