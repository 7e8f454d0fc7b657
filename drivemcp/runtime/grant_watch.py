"""A grant that may be taken back while it serves: the file and the keys are looked at whenever it is asked for.

What has ended stays ended: a clock that is set back, the same file put there again, and a restart change nothing.
"""

import os
import threading
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED
from drivemcp.runtime.grants import GrantRefused, in_time, public_key, read_grant, verify_grant
from proto.decision import Grant

Look = tuple[int, int, int, int] | None
_LONG_AGO = datetime(1970, 1, 1, tzinfo=UTC)


def steady_ns() -> int:
    """A clock that cannot be set, and that goes on while the machine sleeps."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic_ns()


class ForwardTime:
    """The time of day, but never behind what it was with the steady time added: a clock that is set back does not count."""

    def __init__(
        self,
        wall: Callable[[], datetime] = lambda: datetime.now(UTC),
        steady: Callable[[], int] = steady_ns,
        not_before: datetime | None = None,
    ) -> None:
        self._wall, self._steady = wall, steady
        self._last, self._last_ns = max(wall(), not_before or _LONG_AGO), steady()

    def now(self) -> datetime:
        """The instant that validity is judged by."""
        now_ns = self._steady()
        carried = self._last + timedelta(microseconds=(now_ns - self._last_ns) / 1e3)
        self._last, self._last_ns = max(self._wall(), carried), now_ns
        return self._last


class Kept(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a floor keeps in its file."""

    least: dict[str, int] = {}
    latest: datetime = _LONG_AGO


class Floor:
    """The least sequence that still counts, by key, vehicle and capability, and the latest time at which one counted.

    Kept in a file, if one is given: it outlives a restart.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._lock = threading.Lock()
        self._kept = Kept()
        self.problem = ""
        """Why it could not be read or kept; then no grant counts that it might have barred."""
        if file is not None:
            self._load(file)

    @property
    def latest(self) -> datetime:
        """No clock is believed that says less."""
        return self._kept.latest

    def bars(self, grant: Grant) -> str:
        """Why a grant is too old to count; empty: it is not."""
        if self.problem:
            return self.problem
        if grant.sequence < self._kept.least.get(_name(grant), 0):
            return f"grant {grant.grant_id!r} has ended, or a later one took its place"
        return ""

    def accepted(self, grant: Grant, now: datetime) -> None:
        """From now on none before it counts."""
        self._raise(grant, grant.sequence, now)

    def ended(self, grant: Grant, now: datetime) -> None:
        """From now on neither it nor one before it counts."""
        self._raise(grant, grant.sequence + 1, now)

    def _raise(self, grant: Grant, least: int, now: datetime) -> None:
        with self._lock:
            known = self._kept.least
            name = _name(grant)
            self._kept = Kept(least={**known, name: max(least, known.get(name, 0))}, latest=max(now, self._kept.latest))
            if self._file is not None:
                self._keep(self._file)

    def _load(self, file: Path) -> None:
        try:
            self._kept = msgspec.json.decode(file.read_bytes(), type=Kept)
        except FileNotFoundError:
            return
        except (OSError, *MALFORMED) as error:
            self.problem = f"which grants have ended cannot be read from {file}: {error}"

    def _keep(self, file: Path) -> None:
        scratch = file.with_name(f".{file.name}.{os.getpid()}")
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o640)
            with os.fdopen(descriptor, "wb") as out:
                out.write(msgspec.json.encode(self._kept))
            os.replace(scratch, file)
        except OSError as error:
            self.problem = f"which grants have ended cannot be kept in {file}: {error.strerror}"


class WatchedGrant:
    """The grant in a file, as it counts at the moment it is asked for."""

    def __init__(
        self,
        file: Path,
        *,
        keys: "TrustedKeys",
        vehicle: str,
        capability: str,
        floor: Floor,
        clock: ForwardTime | None = None,
    ) -> None:
        self._file, self._keys, self._floor = file, keys, floor
        self._vehicle, self._capability = vehicle, capability
        self._clock = clock or ForwardTime(not_before=floor.latest)
        self._look: tuple[Look, Look] | None = None
        self._grant: Grant | None = None
        self._refused = "no grant"

    def current(self) -> tuple[Grant | None, str]:
        """The grant; or None and why it does not count. Where nothing changed, it costs two looks at files."""
        look = (_look(self._file), self._keys.look())
        if look != self._look:
            self._look = look
            self._read_again()
        if self._grant is not None and not in_time(self._grant, self._clock.now()):
            self._end("the grant has expired")
        return self._grant, self._refused

    def keep(self) -> None:
        """Keep the time while a grant counts: a restart behind a clock that was set back lengthens nothing. Call now and then."""
        if (grant := self._grant) is not None:
            self._floor.accepted(grant, self._clock.now())

    def _read_again(self) -> None:
        before = self._grant
        try:
            found = self._verified()
        except GrantRefused as error:
            self._end(str(error))
            return
        if before is not None and before != found:
            self._floor.ended(before, self._clock.now())
        if barred := self._floor.bars(found):
            self._grant, self._refused = None, barred
            return
        self._grant, self._refused = found, ""
        self._floor.accepted(found, self._clock.now())

    def _verified(self) -> Grant:
        try:
            data = self._file.read_bytes()
        except FileNotFoundError:
            raise GrantRefused("the grant was taken back") from None
        except OSError as error:
            raise GrantRefused(f"the grant cannot be read: {error.strerror}") from None
        grant = read_grant(data)
        verify_grant(
            grant, self._keys.current(), vehicle=self._vehicle, capability=self._capability, now=self._clock.now()
        )
        return grant

    def _end(self, why: str) -> None:
        if self._grant is not None:
            self._floor.ended(self._grant, self._clock.now())
        self._grant, self._refused = None, why


class TrustedKeys:
    """Public keys whose grants count: those of the settings, and those of a file that may change."""

    def __init__(self, keys: Sequence[str] = (), file: str = "") -> None:
        self._keys, self._file = tuple(keys), Path(file) if file else None

    def __bool__(self) -> bool:
        return bool(self._keys) or self._file is not None

    def look(self) -> Look:
        """How the file looks; it is not opened."""
        return _look(self._file) if self._file is not None else None

    def current(self) -> tuple[str, ...]:
        """Those that count now. A file that cannot be read names none. Raises GrantRefused for a line that is no key."""
        if self._file is None:
            return self._keys
        try:
            text = self._file.read_text(encoding="ascii", errors="replace")
        except OSError:
            return self._keys
        lines = (line.split("#", 1)[0].strip() for line in text.splitlines())
        return (*self._keys, *(public_key(line) for line in lines if line))


def _look(path: Path) -> Look:
    try:
        at = path.stat()
    except OSError:
        return None
    return at.st_mtime_ns, at.st_ctime_ns, at.st_size, at.st_ino


def _name(grant: Grant) -> str:
    return f"{grant.key_id} {grant.vehicle} {grant.capability}"
