"""Processes of one drive, found by its own runtime folder in their environment."""

from pathlib import Path


def marked(folder: Path) -> dict[int, str]:
    """The processes whose `XDG_RUNTIME_DIR` is the folder, and their command lines."""
    mark, found = f"XDG_RUNTIME_DIR={folder}\0".encode(), {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (place / "environ").read_bytes() + b"\0":
                found[int(place.name)] = (place / "cmdline").read_text().replace("\0", " ")
        except (OSError, ValueError):
            continue
    return found
