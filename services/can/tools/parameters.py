"""Arguments that several tools take, described with unit and example."""

from typing import Annotated

import msgspec

Number = Annotated[int, msgspec.Meta(ge=0, lt=1 << 29)]
HexText = Annotated[str, msgspec.Meta(max_length=12)]
RequestId = Annotated[
    Number | HexText,
    msgspec.Meta(description="id on which the unit is asked: a number or hex text; engine: 0x7E0", examples=["0x7E0"]),
]
ResponseId = Annotated[
    Number | HexText,
    msgspec.Meta(
        description="id on which the unit answers: 8 above the request's 11 bits", examples=["0x7E8", "0x18DAF110"]
    ),
]


def number_of(value: int | str, name: str, limit: int) -> int:
    """A number given as such or as hex text (0x...). Raises ValueError naming the argument."""
    try:
        number = value if isinstance(value, int) else int(value, 16 if value.lower().startswith("0x") else 10)
    except ValueError:
        number = -1
    if not 0 <= number <= limit:
        raise ValueError(
            f"{name}: {str(value)[:12]!r} is no number from 0 to 0x{limit:X}; write it as in 0x{limit >> 1:X}"
        )
    return number
