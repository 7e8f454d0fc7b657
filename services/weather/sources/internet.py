"""Asks weather services on the internet from a thread of its own: cached, paced, backed off, and content to be offline.

Caching, conditional requests and stale answers while a service is away are requests-cache's work (RFC 9111). What is
here is the pace. No tick ever waits for it: what was answered last is there to be read, and ages.
"""

import re
import threading
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from drivemcp.errors import ConfigError
from drivemcp.files.addresses import is_private
from services.weather.observations.observation import Observation
from services.weather.sources.met_norway import met_norway
from services.weather.sources.open_meteo import open_meteo
from services.weather.sources.provider import NS, Place, Provider, UnusableAnswer, rounded

TIMEOUT_S = (5.0, 10.0)
"""To connect, and between two packets."""
FIRST_BACK_OFF_S, LONGEST_BACK_OFF_S = 30.0, 1800.0
KEPT_S = 12 * 3600
"""An answer is used so long after it expired, where nothing newer is to be had."""


class InternetConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which services are asked, from where, and how often. None by default: nothing leaves the car unasked."""

    providers: tuple[str, ...] = ()
    """`met_norway`, `open_meteo`, `metar:EDDB` (an airfield)."""
    addresses: dict[str, str] = {}
    """Provider -> another address than its publisher's, as that of a proxy."""
    contact: str = ""
    """An e-mail address or a site; sent with each request. MET Norway answers no request without one."""
    latitude_deg: float | None = None
    """Where the car is; only the nearest hundredth of a degree is sent."""
    longitude_deg: float | None = None
    """Where the car is; only the nearest hundredth of a degree is told to anyone."""
    every_s: float = 600.0
    """A service's own `Expires` may make it rarer."""
    cache: str | None = None
    """File in which answers outlive a restart; unset: memory."""


class Asked(msgspec.Struct, kw_only=True):
    """How it stands with one provider."""

    provider: Provider
    body: bytes | None = None
    failures: int = 0
    next_ns: int = 0
    status: str = "not asked yet"


class Internet:
    """Keeps the newest answer of each provider. `observations` is cheap and never waits."""

    def __init__(self, config: InternetConfig, providers: tuple[Provider, ...], now_ns: Callable[[], int]) -> None:
        self._config, self._now_ns = config, now_ns
        self._asked = tuple(Asked(provider=provider) for provider in providers)
        self._place = _place(config)
        self._session = _session(config, [provider.address(self._place) for provider in providers])
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="weather-internet", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def close(self) -> None:
        """Ask no more; a request under way is left to its time-out."""
        self._stopped.set()
        self._thread.join(0.5)

    def observations(self, now_ns: int) -> tuple[Observation, ...]:
        """What the last answers say of `now_ns`; one that says nothing of it any more is left out."""
        found = []
        for asked in self._asked:
            if asked.body is not None:
                try:
                    found.append(asked.provider.read(asked.body, now_ns))
                except UnusableAnswer as error:
                    asked.status = str(error)
        return tuple(found)

    @property
    def status(self) -> dict[str, str]:
        """Provider -> how it stands, for the service's health."""
        return {asked.provider.name: asked.status for asked in self._asked}

    def ask(self, asked: Asked) -> None:
        """One request, and when the next one is due."""
        now_ns = self._now_ns()
        try:
            body, fresh = self._get(asked.provider.address(self._place))
            asked.provider.read(body, now_ns)
        except (OSError, UnusableAnswer) as error:
            self._failed(asked, now_ns, str(error)[:200])
            return
        asked.body = body
        if not fresh:
            self._failed(asked, now_ns, "offline: an older answer is used")
            return
        asked.failures, asked.status = 0, "ok"
        asked.next_ns = now_ns + int(self._config.every_s * NS)

    def _failed(self, asked: Asked, now_ns: int, why: str) -> None:
        pause_s = min(LONGEST_BACK_OFF_S, FIRST_BACK_OFF_S * 2**asked.failures)
        asked.failures, asked.status = asked.failures + 1, f"{why}; asked again in {pause_s:.0f} s"
        asked.next_ns = now_ns + int(pause_s * NS)

    def _get(self, address: str) -> tuple[bytes, bool]:
        """(body, whether it may be used as fresh). Raises OSError, which requests' own errors are."""
        response: Any = self._session.get(address, timeout=TIMEOUT_S, allow_redirects=False)
        if response.status_code != 200:
            raise OSError(f"it answers {response.status_code}")
        stale = response.from_cache and response.is_expired and not response.revalidated
        return bytes(response.content), not stale

    def _run(self) -> None:
        while not self._stopped.is_set():
            for asked in self._asked:
                if self._now_ns() >= asked.next_ns and not self._stopped.is_set():
                    self.ask(asked)
            self._stopped.wait(1.0)


def _place(config: InternetConfig) -> Place:
    latitude, longitude = config.latitude_deg, config.longitude_deg
    if latitude is None or longitude is None:
        raise ConfigError("internet.latitude_deg and internet.longitude_deg must be set for weather from the internet")
    if not (-90.0 <= latitude <= 90.0 and -180.0 <= longitude <= 180.0):
        raise ConfigError(f"internet.latitude_deg, longitude_deg: {latitude}, {longitude} is no place on earth")
    return rounded(Place(latitude, longitude))


def _session(config: InternetConfig, addresses: list[str]) -> Any:
    for address in addresses:
        if not is_private(address):
            raise ConfigError(f"internet.addresses: weather is asked for over https, not at {address!r}")
    from requests_cache import CachedSession

    session: Any = CachedSession(
        config.cache or "weather",
        backend="sqlite" if config.cache else "memory",
        cache_control=True,
        expire_after=config.every_s,
        stale_if_error=KEPT_S,
    )
    session.headers["User-Agent"] = f"DriveMCP {config.contact}".strip()
    session.trust_env = any(address.startswith("https") for address in addresses)
    return session


FORECASTS: Mapping[str, Callable[..., Provider]] = {"met_norway": met_norway, "open_meteo": open_meteo}
_STATION = re.compile(r"metar:([A-Z]{4})")


def providers(config: InternetConfig) -> tuple[Provider, ...]:
    """The configured services. Raises ConfigError, naming an unknown one."""
    if "met_norway" in config.providers and not config.contact:
        raise ConfigError(
            "internet.contact must be set: MET Norway answers no request without a way to reach its sender"
        )
    return tuple(_provider(name, config.addresses) for name in config.providers)


def _provider(name: str, addresses: Mapping[str, str]) -> Provider:
    base = (addresses[name],) if name in addresses else ()
    if name in FORECASTS:
        return FORECASTS[name](*base)
    if station := _STATION.fullmatch(name):
        from services.weather.sources.metar import metar

        return metar(station[1], *base)
    raise ConfigError(f"internet.providers: {name[:40]!r} is not one of {', '.join(FORECASTS)}, metar:<four letters>")
