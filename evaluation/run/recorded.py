"""A run read back from its log, which has to be as it was written."""

from pathlib import Path

from drivemcp.errors import UserError
from evaluation.metrics import Record, from_log
from evaluation.metrics.record import DAMAGED, TRUTH_FILE
from services.logger.verification.verifier import verify


def record_of(log: Path) -> Record:
    """The run of a log, with the truth beside it.

    Raises UserError naming the file that is missing or damaged, cut or altered: what is measured of half a run is wrong.
    """
    try:
        if fault := fault_of(log):
            raise UserError(f"{log}: it is not as it was written: {fault}")
        record = from_log(log)
    except DAMAGED as error:
        raise UserError(f"{log}: {getattr(error, 'strerror', None) or error}") from None
    if not record.truths:
        raise UserError(f"{log}: the truth of its run is not beside it ({TRUTH_FILE})")
    return record


def fault_of(log: Path) -> str:
    """Where a finished run's log is not as it was written; empty: nowhere. Raises OSError."""
    found = verify(log)
    if not found.intact:
        return str(found.first_bad)
    return "" if found.closed else f"it was cut {found.tail_bytes} bytes behind its last chain record"
