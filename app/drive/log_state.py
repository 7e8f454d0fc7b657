"""What became of a drive's log: verified or not, what is missing from it, whether it was closed."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from app.audit import broken_links
from services.logger.format import time_stamp
from services.logger.verification.report import Report
from services.logger.verification.verifier import verify


class LogState(msgspec.Struct, frozen=True, kw_only=True):
    """The log at the end of a drive. `verified` is `None` without one."""

    verified: bool | None = None
    complaint: str = ""
    """What does not verify, or that there is no log."""
    lost: int = 0
    """Messages that the logger had received and could not write, as far as it could still tell: its health comes once a second."""
    unstamped: str = ""
    """Why a file has no time stamp of its newest head, where one was asked for."""
    trouble: str = ""
    """Why the log is not whole: messages were lost, or it was not closed. Empty: it is whole."""

    @property
    def whole(self) -> bool:
        """Whether a log is there that verifies, lacks nothing, and was closed."""
        return self.verified is True and not self.trouble


def state_of(logs: Sequence[Path], detail: Mapping[str, str]) -> LogState:
    """Reads every file of a drive. `detail` is what the logger's last health said."""
    if not logs:
        return LogState(
            complaint="no log was written; see the folder's log/logger.log", trouble=detail.get("log_trouble", "")
        )
    reports = [verify(log) for log in logs]
    complaint = _complaint(reports)
    lost = max(sum(report.lost for report in reports), _number(detail.get("log_lost", "")))
    if not reports[-1].closed:
        lost += _number(detail.get("log_waiting", ""))
    return LogState(
        verified=not complaint,
        complaint=complaint,
        lost=lost,
        unstamped="; ".join(dict.fromkeys(filter(None, map(time_stamp.refused, logs)))),
        trouble=_trouble(reports, lost, detail.get("log_trouble", "")),
    )


def _complaint(reports: Sequence[Report]) -> str:
    """The first file that is not as it was written, or that does not go on from the one before it."""
    for report in reports:
        if not report.intact:
            return f"{report.file}: {report.first_bad or 'an expected head is missing'}"
    return "; ".join(broken_links(reports))


def _trouble(reports: Sequence[Report], lost: int, said: str) -> str:
    found = []
    if lost:
        why = next((report.lost_why for report in reports if report.lost_why), said)
        found.append(f"{lost} messages are missing from it" + (f": {why}" if why else ""))
    if not reports[-1].closed:  # a logger that was killed leaves one unclosed, and goes on in another
        found.append("its last file was not closed" + (f": {said}" if said else ""))
    return "; ".join(found)


def _number(text: str) -> int:
    return int(text) if text.isdecimal() else 0
