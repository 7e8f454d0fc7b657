"""Whether a call of an actuation tool is allowed: a grant that names the tool, then the confirmation of exactly this command."""

import threading
from collections.abc import Sequence

from drivemcp.runtime.grant_watch import Floor, ForwardTime, TrustedKeys
from drivemcp.runtime.grants import Confirmations, GrantRefused, read_grant, verify_grant
from proto.tools import CallHead


class CallAuthorizer:
    """Judges the calls of one service. Called from the threads that serve tools."""

    def __init__(
        self,
        vehicle: str,
        keys: Sequence[str],
        keys_file: str = "",
        *,
        clock: ForwardTime | None = None,
        confirmations: Confirmations | None = None,
    ) -> None:
        self._vehicle, self._keys = vehicle, TrustedKeys(keys, keys_file)
        self._clock, self._confirmations = clock or ForwardTime(), confirmations or Confirmations()
        self._floor = Floor()
        self._lock = threading.Lock()

    def why_refused(self, name: str, head: CallHead, payload: bytes) -> str:
        """Why the call is refused; empty: it is allowed, this once."""
        with self._lock:
            if why := self._grant_refused(name, head.grant):
                return why
        if self._confirmations.take(name, payload, head.confirmation):
            return ""
        return f"confirm this very command: confirmation must be {self._confirmations.ask(name, payload)!r}"

    def _grant_refused(self, tool: str, text: str) -> str:
        if not text:
            return "it takes a grant (drivemcp grant) and a confirmation of this very command"
        try:
            grant = read_grant(text.encode())
            capability = f"tool:{tool}"
            now = self._clock.now()
            verify_grant(grant, self._keys.current(), vehicle=self._vehicle, capability=capability, now=now)
        except GrantRefused as error:
            return str(error)
        if barred := self._floor.bars(grant):
            return barred
        self._floor.accepted(grant, now)
        return ""
