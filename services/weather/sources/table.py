"""The weather services that can be named in the configuration."""

import re
from collections.abc import Callable, Mapping

from drivemcp.errors import ConfigError
from services.weather.sources.internet import InternetConfig
from services.weather.sources.met_norway import met_norway
from services.weather.sources.open_meteo import open_meteo
from services.weather.sources.provider import Provider

FORECASTS: Mapping[str, Callable[..., Provider]] = {"met_norway": met_norway, "open_meteo": open_meteo}
_STATION = re.compile(r"metar:([A-Z]{4})")


def providers(config: InternetConfig) -> tuple[Provider, ...]:
    """The configured services. Raises ConfigError, naming the one that is none."""
    if "met_norway" in config.providers and not config.contact:
        raise ConfigError("internet.contact must be set: MET Norway answers nobody who does not say how to be reached")
    return tuple(_provider(name, config.addresses) for name in config.providers)


def _provider(name: str, addresses: Mapping[str, str]) -> Provider:
    base = (addresses[name],) if name in addresses else ()
    if name in FORECASTS:
        return FORECASTS[name](*base)
    if station := _STATION.fullmatch(name):
        from services.weather.sources.metar import metar

        return metar(station[1], *base)
    raise ConfigError(f"internet.providers: {name[:40]!r} is none of {', '.join(FORECASTS)}, metar:<four letters>")
