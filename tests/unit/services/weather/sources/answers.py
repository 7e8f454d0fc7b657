"""Answers in the services' formats, with made-up weather."""

import json
from datetime import UTC, datetime, timedelta

from services.weather.sources.provider import NS

NOW = datetime(2026, 11, 21, 12, 0, tzinfo=UTC)
NOW_NS = int(NOW.timestamp()) * NS


def met_norway_body(symbol: str = "cloudy", rain_mm: float = 0.0, fog: float = 0.0, air_c: float = 1.5) -> bytes:
    """Locationforecast 2.0 `complete`: the present hour and two more."""
    rows = [
        {
            "time": (NOW + timedelta(hours=hour)).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "data": {
                "instant": {
                    "details": {
                        "air_pressure_at_sea_level": 1008.1, "air_temperature": air_c + hour, "cloud_area_fraction": 97.0,
                        "dew_point_temperature": 0.4, "fog_area_fraction": fog, "relative_humidity": 92.0,
                        "wind_from_direction": 231.0, "wind_speed": 5.5, "wind_speed_of_gust": 10.2,
                    }
                },
                "next_1_hours": {"summary": {"symbol_code": symbol}, "details": {"precipitation_amount": rain_mm}},
            },
        }
        for hour in (0, 1, 2)
    ]  # fmt: skip
    units = {
        "air_pressure_at_sea_level": "hPa", "air_temperature": "celsius", "dew_point_temperature": "celsius",
        "fog_area_fraction": "%", "precipitation_amount": "mm", "relative_humidity": "%", "wind_speed": "m/s",
        "wind_speed_of_gust": "m/s",
    }  # fmt: skip
    updated = (NOW - timedelta(hours=1)).strftime("%Y-%m-%dT%H:%M:%SZ")
    return json.dumps(
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [13.41, 52.52, 36]},
            "properties": {"meta": {"updated_at": updated, "units": units}, "timeseries": rows},
        }
    ).encode()


def open_meteo_body(rain: list[float] | None = None, snowfall: list[float] | None = None) -> bytes:
    """The forecast for three hours, told at their ends: the one before now, the one that runs, the one after."""
    ends = [int(NOW.timestamp()) + 3600 * hour for hour in (0, 1, 2)]
    hourly = {
        "time": ends, "temperature_2m": [2.1, 2.4, 2.9], "dew_point_2m": [1.0, 1.2, 1.3],
        "relative_humidity_2m": [93, 92, 90], "rain": rain or [0.0] * 3, "showers": [0.0, 0.4, 0.0],
        "snowfall": snowfall or [0.0] * 3, "visibility": [9000.0, 8000.0, 24140.0],
        "wind_speed_10m": [4.1, 4.4, 4.0], "wind_gusts_10m": [9.0, 9.6, 8.8],
    }  # fmt: skip
    units = {
        "time": "unixtime", "temperature_2m": "°C", "dew_point_2m": "°C", "relative_humidity_2m": "%", "rain": "mm",
        "showers": "mm", "snowfall": "cm", "visibility": "m", "wind_speed_10m": "m/s", "wind_gusts_10m": "m/s",
    }  # fmt: skip
    return json.dumps(
        {"latitude": 52.52, "longitude": 13.41, "elevation": 38.0, "hourly_units": units, "hourly": hourly}
    ).encode()
