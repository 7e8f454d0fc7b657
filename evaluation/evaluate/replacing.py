"""Files that a full disk or an interruption must not cut."""

from pathlib import Path


def write_whole(file: Path, data: bytes) -> None:
    """The file is there whole, or stays as it was. Raises OSError."""
    part = file.with_name(f"{file.name}.part")
    try:
        part.write_bytes(data)
        part.replace(file)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
