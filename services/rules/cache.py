"""A bounded memory of answers, oldest use forgotten first; safe across threads."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

V = TypeVar("V")


class Cache(Generic[V]):
    """At most `size` values."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._values: OrderedDict[Hashable, V] = OrderedDict()
        self._lock = threading.Lock()
        self.hits = 0
        self.misses = 0

    def get(self, key: Hashable, serves: Callable[[V], bool] | None = None) -> V | None:
        """The value, which counts as used now; None where there is none, or one that does not serve."""
        with self._lock:
            value = self._values.get(key)
            if value is None or (serves is not None and not serves(value)):
                self.misses += 1
                return None
            self.hits += 1
            self._values.move_to_end(key)
            return value

    def put(self, key: Hashable, value: V) -> None:
        """Keep a value."""
        with self._lock:
            self._values[key] = value
            self._values.move_to_end(key)
            while len(self._values) > self.size:
                self._values.popitem(last=False)

    def said(self) -> str:
        """For people: how many of the questions were answered from here, and how full it is."""
        with self._lock:
            asked = self.hits + self.misses
            share = f"{self.hits / asked:.0%} of {asked}" if asked else "none asked"
            return f"hits {share}, kept {len(self._values)} of {self.size}"

    def __len__(self) -> int:
        return len(self._values)
