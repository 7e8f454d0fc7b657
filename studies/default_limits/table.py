"""The table in its published format: by country or part the rows of its types of road, and which row holds for a road."""

from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED, UserError
from studies.default_limits.filters import FilterError, Tags, Test, compiled

MOST_NESTED = 32
"""Filters within filters; deeper they name each other in a ring."""


class TableError(UserError):
    """A file that is not the table, or one that says what cannot be."""


class Row(msgspec.Struct, frozen=True):
    """The limits of one type of road; without a name, of every other."""

    tags: dict[str, str]
    name: str | None = None


class RoadType(msgspec.Struct, frozen=True, rename="camel"):
    """By which of a road's tags a type is known. What tells it by a guess or by its routes is not asked."""

    filter: str = ""


class Meta(msgspec.Struct, frozen=True, rename="camel"):
    """Where the table comes from."""

    source: str = ""
    revision_id: str = ""
    timestamp: str = ""


class Table(msgspec.Struct, frozen=True, rename="camel"):
    """The file."""

    road_types_by_name: dict[str, RoadType]
    speed_limits_by_country_code: dict[str, tuple[Row, ...]]
    meta: Meta = Meta()

    def rows(self, code: str) -> tuple[Row, ...]:
        """Of a part of a country, else of the country; ISO 3166-2, for example `GB-SCT`."""
        rows = self.speed_limits_by_country_code
        return rows.get(code) or rows.get(code.partition("-")[0]) or ()

    def row(self, code: str, road: Tags) -> Row | None:
        """The row that holds for a road: of those below the row without a name the last that fits, then of those above it the first."""
        rows = self.rows(code)
        rest = next((at for at, row in enumerate(rows) if row.name is None), len(rows))
        ordered = (*reversed(rows[rest + 1 :]), *rows[:rest]) if rest < len(rows) else tuple(reversed(rows))
        fitting = (row for row in ordered if row.name is not None and self._test(row.name)(road))
        return next(fitting, rows[rest] if rest < len(rows) else None)

    def _test(self, name: str, deep: int = 0) -> Test:
        if deep > MOST_NESTED:
            raise FilterError(f"the filter of {name!r} leads back to itself")
        found = self.road_types_by_name.get(name)
        if found is None or not found.filter:
            return lambda tags: False
        return compiled(found.filter, lambda inner: self._test(inner, deep + 1))


def read_table(path: Path) -> Table:
    """Raises TableError where the file cannot be read or has another form."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Table)
    except OSError as error:
        raise TableError(f"{path}: cannot be read: {error.strerror}") from None
    except MALFORMED as error:
        raise TableError(f"{path} is not the table: {error}") from None
