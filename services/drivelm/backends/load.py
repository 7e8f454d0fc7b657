"""Backends by name."""

import logging
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from drivemcp.errors import ConfigError
from services.drivelm.backends.backend import SlowBackend
from services.drivelm.backends.config import GgufConfig, OpenaiConfig, TransformersConfig
from services.drivelm.backends.prompts import Prompts
from services.drivelm.backends.prompts import load as load_prompts

if TYPE_CHECKING:
    from services.drivelm.backends.gguf import GgufBackend

NEEDED: Mapping[str, tuple[str, ...]] = {"transformers": ("torch", "transformers", "PIL"), "openai": ("httpx2",)}
"""Backend to the modules of its extra."""


class Slow(msgspec.Struct, frozen=True, kw_only=True):
    """The settings of all slow backends."""

    transformers: TransformersConfig
    openai: OpenaiConfig


def load(name: str, settings: Slow) -> SlowBackend:
    """A slow backend, ready to be asked. Raises ConfigError in one line that names the field, or the extra to install."""
    if name == "gguf":
        raise ConfigError(
            "drivelm.backend = gguf sees no pictures: it answers whole prompts, as drivelm.prompt_backend"
        )
    if name not in _MAKERS:
        raise ConfigError(f"drivelm.backend is {name!r}; there is: {', '.join(('embedded', *_MAKERS))}")
    missing = [module for module in NEEDED[name] if find_spec(module) is None]
    if missing:
        raise ConfigError(
            f"drivelm.backend = {name} needs {', '.join(missing)}: pip install 'drivemcp[drivelm-{name}]'"
        )
    logging.getLogger("httpx2").setLevel(logging.WARNING)  # a line for every request otherwise
    return _MAKERS[name](settings, load_prompts())


class Completed(NamedTuple):
    """What a model without instructions completes: the text that all prompts begin with, the grammar of answers, the template's hash."""

    head: str
    grammar: str
    sha256: str


def load_completing(config: GgufConfig, completed: Completed) -> "GgufBackend":
    """The language model of a GGUF file. Raises ConfigError in one line that names the field, or the extra to install."""
    if find_spec("llama_cpp") is None:
        raise ConfigError("drivelm.prompt_backend = gguf needs llama_cpp: pip install 'drivemcp[language-model]'")
    from services.drivelm.backends.gguf import GgufBackend

    return GgufBackend(config, completed)


def _transformers(settings: Slow, prompts: Prompts) -> SlowBackend:
    from services.drivelm.backends.transformers import TransformersBackend

    return TransformersBackend(settings.transformers, prompts)


def _openai(settings: Slow, prompts: Prompts) -> SlowBackend:
    from services.drivelm.backends.openai import OpenaiBackend

    return OpenaiBackend(settings.openai, prompts)


_MAKERS: Mapping[str, Callable[[Slow, Prompts], SlowBackend]] = {"transformers": _transformers, "openai": _openai}
