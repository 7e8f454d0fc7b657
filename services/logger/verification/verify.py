"""`audit verify`: reads a log from first byte to last and names the first record that is not as it was written.

Every byte is accounted for: the opening and all chunks by the byte hash in the chain record behind them, the chain
records by the running head, their signature and their exact form, the summary by building it anew from the data.
"""

import mmap
from pathlib import Path

from services.logger.verification.report import UNSEALED, Report
from services.logger.verification.verifier import Walk


def verify(path: Path, *, expected_head: str = "", public_key: str = "") -> Report:
    """Reads the whole file. `expected_head` must be one of its heads; `public_key` (hex) must be the one that signed.

    Raises OSError where the file cannot be read.
    """
    if path.stat().st_size == 0:
        bad = None if expected_head else UNSEALED
        return Report(file=str(path), size=0, first_bad=bad, expected_head_missing=bool(expected_head))
    with (
        path.open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped,
        memoryview(mapped) as data,
    ):
        walk = Walk(data, mapped, expected_head=expected_head, public_key=public_key)
        walk.run()
        return walk.report(str(path))
