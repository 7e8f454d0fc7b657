"""Models by name: a table with publisher, licence, address and checksum; which of them are here, and whether they are whole."""

import hashlib
import json
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from drivemcp.errors import UserError
from drivemcp.paths import data

TABLE = "models/table.toml"
State = Literal["whole", "absent", "differs"]
_CHUNK = 1 << 20

FileName = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*\.(onnx|gguf)$")]
Digest = Annotated[str, msgspec.Meta(pattern=r"^([0-9a-f]{64})?$")]


class ModelRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One model. Shipped ones lie beside the table, and their card (`FILE.json`) holds the checksum."""

    file: FileName
    publisher: str
    licence: str
    good_for: str
    input: str
    classes: str
    url: str = ""
    sha256: Digest = ""
    size_bytes: Annotated[int, msgspec.Meta(ge=0)] = 0
    shipped: bool = False
    note: str = ""
    package: str = ""
    """The module of an installed distribution that has the file in parts; in place of an address."""
    extra: str = ""
    """The extra that brings the package."""
    terms: str = ""
    """Where the terms stand that have to be accepted before the file is kept here; empty: no terms beside the licence."""


def model_folder() -> Path:
    """Where pulled models lie: DRIVEMCP_MODELS, else `drivemcp/models` in the XDG data home."""
    if os.environ.get("DRIVEMCP_MODELS"):
        return Path(os.environ["DRIVEMCP_MODELS"])
    home = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(home) / "drivemcp" / "models"


def load_table(folder: Path) -> dict[str, ModelRow]:
    """The rows of our table, and those that a table.toml in the user's model folder adds. Raises UserError."""
    rows = _read(data(TABLE))
    own = folder / "table.toml"
    added = _read(own) if own.is_file() else {}
    for name, row in added.items():
        if name in rows or row.shipped:
            raise UserError(f"{own}: {name!r} is a model of the installed table; choose another name")
        if row.file in {other.file for other in rows.values()}:
            raise UserError(f"{own}: {name}.file: {row.file!r} is another model's file")
        if not row.sha256 or not row.url or not row.size_bytes or row.package:
            raise UserError(f"{own}: {name} needs url, sha256 and size_bytes, and no package")
    return rows | added


def _read(path: Path) -> dict[str, ModelRow]:
    try:
        return msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8-sig")), dict[str, ModelRow])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise UserError(f"the table of models {path}: {error}") from None


def row_of(table: Mapping[str, ModelRow], name: str) -> ModelRow:
    """The row of a name. Raises UserError naming those there are."""
    if name not in table:
        raise UserError(f"no model {name!r}; there are {', '.join(table)}")
    return table[name]


def path_of(row: ModelRow, folder: Path) -> Path:
    """Where the model is, or will be."""
    return data(f"models/{row.file}") if row.shipped else folder / row.file


def digest_of(path: Path) -> str:
    """SHA-256 of a file, as hex."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


def expected_digest(row: ModelRow) -> str:
    """The checksum that the file must have: the table's, or the card's of a shipped model. Raises UserError."""
    if not row.shipped:
        return row.sha256
    card = data(f"models/{row.file}").with_suffix(".json")
    try:
        return str(json.loads(card.read_text(encoding="utf-8-sig"))["sha256"])
    except (OSError, ValueError, KeyError, TypeError):
        raise UserError(f"{card} holds no `sha256`: is the installation complete?") from None


def state_of(row: ModelRow, folder: Path) -> State:
    """Whether the model is here and what its checksum says. Raises UserError where it cannot be read."""
    path = path_of(row, folder)
    if not path.is_file():
        return "absent"
    try:
        return "whole" if digest_of(path) == expected_digest(row) else "differs"
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None


def find_model(wanted: str, folder: Path | None = None) -> Path:
    """The file that a name or a path means; a named one is verified first. Raises UserError saying what to do."""
    if Path(wanted).is_file():
        return Path(wanted).resolve()
    folder = folder or model_folder()
    table = load_table(folder)
    if wanted not in table:
        raise UserError(f"no such model or file: {wanted}; the names are {', '.join(table)} (drivemcp models list)")
    state = state_of(table[wanted], folder)
    if state == "absent":
        raise UserError(f"the model {wanted!r} is not here yet; fetch it with: drivemcp models pull {wanted}")
    if state == "differs":
        raise UserError(
            f"{path_of(table[wanted], folder)} is not what its checksum says; fetch it again: drivemcp models pull {wanted}"
        )
    return path_of(table[wanted], folder).resolve()
