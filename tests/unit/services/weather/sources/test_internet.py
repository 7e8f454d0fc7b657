"""Asking a local server that answers as weather services do, and as they do when they fail."""

import threading
import time
from collections.abc import Iterator
from email.utils import formatdate
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from drivemcp.errors import ConfigError
from drivemcp.testing import serving
from services.weather.sources.internet import (
    FIRST_BACK_OFF_S,
    LONGEST_BACK_OFF_S,
    Asked,
    Internet,
    InternetConfig,
    providers,
)
from services.weather.sources.provider import NS
from tests.unit.services.weather.sources.answers import NOW_NS, met_norway_body, open_meteo_body

METAR = b"EDDB 211150Z 24012KT 3000 -RA BKN020 04/03 Q1008\n"


class Station(ThreadingHTTPServer):
    """Answers `/met`, `/open` and `/metar`; `status` other than 200 is answered to everything."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.bodies = {"/met": met_norway_body(rain_mm=1.0), "/open": open_meteo_body(), "/metar": METAR}
        self.status = 200
        self.expires_s: float | None = None
        self.asked: list[tuple[str, Any]] = []

    def url(self, path: str) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}{path}"


class _Handler(BaseHTTPRequestHandler):
    server: Station

    def do_GET(self) -> None:
        self.server.asked.append((self.path, self.headers))
        known = self.headers.get("If-Modified-Since") is not None
        status = 304 if known and self.server.status == 200 else self.server.status
        body = self.server.bodies[self.path.partition("?")[0]] if status == 200 else b""
        self.send_response(status)
        if status in (200, 304):
            self.send_header("Last-Modified", formatdate(1.79e9, usegmt=True))
        if self.server.expires_s is not None:
            self.send_header("Expires", formatdate(self.server.expires_s, usegmt=True))
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        pass


@pytest.fixture
def station() -> Iterator[Station]:
    with serving(Station()) as server:
        yield server


def _config(station: Station, *names: str, **fields: Any) -> InternetConfig:
    addresses = {"met_norway": "/met", "open_meteo": "/open", "metar:EDDB": "/metar"}
    return InternetConfig(
        providers=names,
        addresses={name: station.url(addresses[name]) for name in names},
        contact="drive@example.org",
        latitude_deg=52.520817,
        longitude_deg=13.409419,
        **fields,
    )


def _internet(config: InternetConfig, now_ns: int = NOW_NS) -> tuple[Internet, tuple[Asked, ...]]:
    internet = Internet(config, providers(config), lambda: now_ns)
    return internet, internet._asked


def test_every_service_becomes_an_observation(station: Station) -> None:
    internet, asked = _internet(_config(station, "met_norway", "open_meteo", "metar:EDDB"))
    for each in asked:
        internet.ask(each)
    told = {each.source: each for each in internet.observations(NOW_NS)}
    assert set(told) == {"MET Norway", "Open-Meteo", "METAR EDDB"}
    assert set(internet.status.values()) == {"ok"}
    assert told["METAR EDDB"].rain_mm_h is not None
    path, headers = station.asked[0]
    assert "lat=52.52&lon=13.41" in path, "no more of the place than a kilometre"
    assert headers["User-Agent"] == "DriveMCP drive@example.org"


def test_an_answer_that_has_not_expired_is_not_asked_for_again(station: Station) -> None:
    station.expires_s = 4e9
    internet, (asked,) = _internet(_config(station, "met_norway"))
    internet.ask(asked)
    internet.ask(asked)
    assert len(station.asked) == 1
    assert asked.status == "ok"


def test_an_expired_answer_is_asked_for_only_if_it_changed(station: Station) -> None:
    station.expires_s = time.time() - 60.0
    internet, (asked,) = _internet(_config(station, "met_norway"))
    internet.ask(asked)
    internet.ask(asked)
    assert station.asked[1][1]["If-Modified-Since"] is not None
    assert asked.status == "ok", "304: what is kept is fresh again"


@pytest.mark.parametrize("status", [403, 429, 500, 503])
def test_a_service_that_fails_is_asked_ever_more_rarely(station: Station, status: int) -> None:
    station.status = status
    internet, (asked,) = _internet(_config(station, "open_meteo"))
    pauses = []
    for _ in range(9):
        internet.ask(asked)
        pauses.append((asked.next_ns - NOW_NS) / NS)
    assert pauses[:3] == [FIRST_BACK_OFF_S, 2 * FIRST_BACK_OFF_S, 4 * FIRST_BACK_OFF_S]
    assert pauses[-1] == LONGEST_BACK_OFF_S
    assert str(status) in asked.status
    assert internet.observations(NOW_NS) == ()


def test_offline_the_last_answer_is_used_while_it_speaks_of_the_present(station: Station) -> None:
    station.expires_s = time.time() - 60.0
    internet, (asked,) = _internet(_config(station, "met_norway"))
    internet.ask(asked)
    station.status = 503
    internet.ask(asked)
    assert asked.status.startswith("offline: an older answer is used")
    (told,) = internet.observations(NOW_NS + 3600 * NS)
    assert told.air_c is not None
    assert told.air_c.high == pytest.approx(4.5), "the next hour of the same forecast"
    assert internet.observations(NOW_NS + 24 * 3600 * NS) == ()
    assert "is the present one" in asked.status


def test_answers_outlive_a_restart_where_a_file_is_named(station: Station, tmp_path: Path) -> None:
    config = _config(station, "met_norway", cache=str(tmp_path / "weather.sqlite"))
    station.expires_s = time.time() - 60.0
    internet, (asked,) = _internet(config)
    internet.ask(asked)
    station.status = 503
    again, (asked_again,) = _internet(config)
    again.ask(asked_again)
    assert len(again.observations(NOW_NS)) == 1


def test_nonsense_takes_no_earlier_answer_away(station: Station) -> None:
    internet, (asked,) = _internet(_config(station, "open_meteo"))
    internet.ask(asked)
    station.bodies["/open"] = b"<html>maintenance</html>"
    station.expires_s = None
    internet._session.cache.clear()
    internet.ask(asked)
    assert "it is a page, not JSON" in asked.status
    assert len(internet.observations(NOW_NS)) == 1


def test_asking_runs_beside_everything_else_and_ends(station: Station) -> None:
    internet, (asked,) = _internet(_config(station, "met_norway"))
    internet.start()
    answered = threading.Event()
    for _ in range(500):
        if asked.status == "ok" or answered.wait(0.01):
            break
    internet.close()
    internet._thread.join(10.0)
    assert asked.status == "ok"
    assert not internet._thread.is_alive()


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"latitude_deg": None}, "internet.latitude_deg"),
        ({"latitude_deg": 152.0}, "is no place on earth"),
        ({"contact": ""}, "internet.contact must be set"),
        (
            {"providers": ("accu",)},
            "internet.providers: 'accu' is not one of met_norway, open_meteo, metar:<four letters>",
        ),
        ({"addresses": {"met_norway": "http://example.org/"}}, "asked for over https, not at 'http://example.org/"),
    ],
)
def test_a_wrong_setting_is_named(station: Station, fields: dict[str, Any], says: str) -> None:
    import msgspec

    with pytest.raises(ConfigError, match=says):
        _internet(msgspec.structs.replace(_config(station, "met_norway"), **fields))
