"""The languages that advice is spoken in, and which of them a driver gets."""

from typing import get_args

from proto.decision import Language

LANGUAGES: tuple[str, ...] = get_args(Language)


def spoken_language(language: str) -> str:
    """One of ours: `de-AT` is German, what we do not speak becomes English."""
    short = language.lower()[:2]
    return short if short in LANGUAGES else "en"
