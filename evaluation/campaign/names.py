"""What the command line needs to know of the tables."""

from typing import Literal, get_args

TableName = Literal["results", "corruption", "delta", "ablation", "can-fault"]
TABLES: tuple[TableName, ...] = get_args(TableName)
QUICK_S = 5.0
