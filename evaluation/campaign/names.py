"""What the command line needs to know of the tables."""

from typing import Literal, get_args

TableName = Literal["results", "corruption", "delta", "ablation", "can-fault", "proposer"]
PROPOSER: TableName = "proposer"
"""The table of a language model: it takes an extra, and is no part of `all`."""
TABLES: tuple[TableName, ...] = tuple(name for name in get_args(TableName) if name != PROPOSER)
"""The paper's."""
QUICK_S = 5.0
