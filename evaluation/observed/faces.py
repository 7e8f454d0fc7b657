"""Which of the reader's classes a drawn face is of, by country and code."""

from functools import cached_property

from evaluation.observed.orders import orders
from services.drivelm.vocabulary.classes import OTHER, PANELS, PLATES, READER_CLASSES, SIGNS


class Classes:
    """Looks faces up; `code` is `COUNTRY CODE` as `sight.Thing` has it."""

    @cached_property
    def _table(self) -> dict[str, str]:
        table: dict[str, str] = {}
        for name in (*SIGNS, *PLATES):
            for order in orders(name):
                table.setdefault(f"{order.country} {order.code}", name)
        return table

    def label(self, code: str) -> str:
        """The class; `other` for what the reader does not read."""
        bare = code.partition(" ")[2]
        if bare.startswith(("led:", "light:")):
            return bare if bare in READER_CLASSES else OTHER
        return self._table.get(code, OTHER) if f"led:{bare}" not in PANELS else self._table.get(code, f"led:{bare}")


CLASSES = Classes()
