"""Files that a full disk or an interruption must not cut."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile

from drivemcp.errors import UserError


def write_whole(file: Path, data: bytes) -> None:
    """The file is there whole, or stays as it was. Raises OSError."""
    part = file.with_name(f"{file.name}.part")
    try:
        part.write_bytes(data)
        part.replace(file)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


@contextmanager
def writing(flag: str, file: Path) -> Iterator[None]:
    """What is written within goes to the file that a flag names, whose folder is made. Raises UserError where it cannot be written."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise UserError(f"{flag} {file}: {error.strerror}; name a file that can be written") from None


def check_writable(flag: str, file: Path) -> None:
    """Before long work: the file that a flag names can be written; its folder is made. Raises UserError."""
    with writing(flag, file):
        TemporaryFile(dir=file.parent).close()
    if file.is_dir():
        raise UserError(f"{flag} {file}: is a folder; name a file in it")
