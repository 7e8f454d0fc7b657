"""The logger's small log files."""

from tests.unit.services.logger.conftest import closed_log, signer, unclosed

__all__ = ["closed_log", "signer", "unclosed"]
