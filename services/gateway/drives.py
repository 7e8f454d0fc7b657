"""Reports of earlier drives: `report.html` in the folders beside this drive's own. Nothing is followed out of there."""

import errno
import os
import re
import stat
from pathlib import Path

MOST_DRIVES = 50
MOST_LOOKED_AT = 2000
MOST_BYTES = 20_000_000
"""The bound on a report of ten minutes."""
REPORT = "report.html"
LOGS = "logs"
"""What makes a folder a drive's."""
NO_REPORT = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP)
"""Errors of a report that is not there, or is a link."""
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,99}")
_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


class Drives:
    """The drives of one folder; None: no folder, and so no drives."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    def names(self) -> tuple[str, ...]:
        """Of drives with a report, the newest report first."""
        found: list[tuple[int, str]] = []
        try:
            with os.scandir(self._folder or "") as entries:
                for entry, _ in zip(entries, range(MOST_LOOKED_AT), strict=False):
                    if _NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                        found += [(stamp_ns, entry.name) for stamp_ns in _written_ns(Path(entry.path))]
        except OSError:
            return ()
        return tuple(name for _, name in sorted(found, reverse=True)[:MOST_DRIVES])

    def report(self, name: str) -> str:
        """The page. Raises OSError, for a report that is not there with one of `NO_REPORT`."""
        if self._folder is None or not _NAME.fullmatch(name):
            raise FileNotFoundError(errno.ENOENT, name)
        above = os.open(self._folder, _FOLDER & ~os.O_NOFOLLOW)
        try:
            folder = os.open(name, _FOLDER, dir_fd=above)
        finally:
            os.close(above)
        try:
            os.close(os.open(LOGS, _FOLDER, dir_fd=folder))
            page = os.open(REPORT, _FILE, dir_fd=folder)
        finally:
            os.close(folder)
        with os.fdopen(page, "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise FileNotFoundError(errno.ENOENT, name)
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise OSError(f"the report of {name} is larger than {MOST_BYTES // 1_000_000} MB")
        return content.decode("utf-8", errors="replace")


def _written_ns(folder: Path) -> tuple[int, ...]:
    """When the report of a drive's folder was written; empty where it has none."""
    try:
        page, logs = (folder / REPORT).lstat(), (folder / LOGS).lstat()
    except OSError:
        return ()
    return (page.st_mtime_ns,) if stat.S_ISREG(page.st_mode) and stat.S_ISDIR(logs.st_mode) else ()
