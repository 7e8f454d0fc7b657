"""Which pages of `docs/reference/` are made, and by what. Pages are made lazily: some need every service."""

from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType

GENERATED: Mapping[str, str] = MappingProxyType(
    {
        "topics": "scripts.reference.tables:topics",
        "services": "scripts.reference.tables:services",
        "tools": "scripts.reference.tools:tools",
        "settings": "scripts.reference.settings:settings",
        "health-indicators": "scripts.reference.health:health",
        "events": "scripts.reference.tables:events",
        "message-kinds": "scripts.reference.tables:kinds",
        "arbiter-constants": "scripts.reference.tables:constants",
        "metrics": "scripts.reference.tables:metrics",
        "commands": "scripts.reference.commands:commands",
        "rulepack-words": "scripts.vocabulary:as_page",
        "glossary": "scripts.reference.glossary:glossary",
    }
)
"""Name of the page to the function that makes it."""


def maker(path: str) -> Callable[[], str]:
    """The function that `module:name` names."""
    module, _, name = path.partition(":")
    made: Callable[[], str] = getattr(import_module(module), name)
    return made
