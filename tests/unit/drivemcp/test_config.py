"""Settings: what is out of its bounds is refused, with the field's name."""

from pathlib import Path

import pytest

from drivemcp.config import ServiceConfig, changed_settings, load_config
from drivemcp.errors import ConfigError


@pytest.mark.parametrize(
    ("setting", "field"),
    [
        ("vehicle=a/b", "vehicle"),
        ("vehicle=", "vehicle"),
        ("vehicle=*", "vehicle"),
        ("tool_workers=0", "tool_workers"),
        ("max_pending_calls=-1", "max_pending_calls"),
        ("bus.connect_timeout_s=0", "connect_timeout_s"),
        ("bus.connect_timeout_s=-1", "connect_timeout_s"),
        ("bus.connect_timeout_s=Infinity", "connect_timeout_s"),
        ("bus.connect_timeout_s=nan", "connect_timeout_s"),
    ],
)
def test_a_setting_out_of_its_bounds_is_refused_by_name(setting: str, field: str) -> None:
    with pytest.raises(ConfigError, match=field):
        load_config(ServiceConfig, None, [setting])


def test_a_vehicle_in_a_file_is_refused_with_the_file(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text('vehicle = "a b"\n')
    with pytest.raises(ConfigError, match=r"x\.toml: vehicle"):
        load_config(ServiceConfig, str(tmp_path / "x.toml"))


def test_settings_within_their_bounds_are_taken() -> None:
    config = load_config(ServiceConfig, None, ["vehicle=car-7", "tool_workers=1", "max_pending_calls=0"])
    assert (config.vehicle, config.tool_workers, config.max_pending_calls) == ("car-7", 1, 0)
    assert load_config(ServiceConfig, None, ["bus.connect_timeout_s=0.5"]).bus.connect_timeout_s == 0.5


def test_a_service_tells_the_settings_that_are_not_their_defaults() -> None:
    assert changed_settings(ServiceConfig()) == ""
    assert changed_settings(ServiceConfig(vehicle="car-7", out_dir="/x")) == "", "where it runs is no setting"
    assert changed_settings(ServiceConfig(tool_workers=7)) == '{"tool_workers":7}'
