"""The files that a person means: in a folder, or beside a file."""

from collections.abc import Collection
from pathlib import Path


def files_of(folder: Path, endings: Collection[str]) -> list[Path]:
    """Those with one of the endings, in lower case, by name. Hidden ones are left out: a Mac writes `._NAME` beside NAME."""
    found = (file for file in folder.iterdir() if file.suffix.lower() in endings and not file.name.startswith("."))
    return sorted(found)


def files_beside(source: Path, endings: Collection[str]) -> list[Path]:
    """Of a folder its files with one of the endings, else those of the same name beside the file, in the order of the endings."""
    if source.is_dir():
        return files_of(source, endings)
    if not source.parent.is_dir():
        return []
    alike = [file for file in source.parent.iterdir() if file.stem.lower() == source.stem.lower() and file != source]
    return [file for ending in endings for file in sorted(alike) if file.suffix.lower() == ending and file.is_file()]
