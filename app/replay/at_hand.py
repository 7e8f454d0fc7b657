"""The profiles with which a log's decisions can be made again: those that are shipped, and files that somebody names."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from app.drive.precheck import profile_of
from services.arbiter.profiles.profile import Profile, load, names


class UnknownProfile(LookupError):
    """The log names a profile that is not at hand with the same content."""


class AtHand:
    """By their content: a file counts whatever its name is. Raises UserError where one is no profile."""

    def __init__(self, files: Sequence[Path] = ()) -> None:
        self._named = {profile.sha256: profile for profile in (profile_of("--profile", str(file)) for file in files)}

    def of(self, name: str, sha256: str) -> Profile:
        """The one of that name and content. Raises UnknownProfile."""
        return self._named.get(sha256) or _shipped(name, sha256)


@cache
def _shipped(name: str, sha256: str) -> Profile:
    if name not in names():
        raise UnknownProfile(f"profile {name!r} is not shipped: give its file with --profile FILE")
    profile = load(name)
    if profile.sha256 != sha256:
        raise UnknownProfile(
            f"profile {name!r} here has other constants than the log's (SHA-256 {sha256[:12]}): give that file with "
            "--profile FILE"
        )
    return profile
