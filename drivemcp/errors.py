"""The few errors of the runtime. On the wire an error is data."""

import msgspec

MALFORMED = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError, OverflowError)
"""What decoding bytes from outside raises: they do not fit, hold text that is no UTF-8 (of which msgspec says nothing in its own
words), nest too deep, or hold numbers beyond all use."""


class DriveMcpError(Exception):
    """Base of all errors of this project."""


class UserError(DriveMcpError, ValueError):
    """A user's mistake: one line that says what is wrong and what to do. The command line prints it and exits with 2."""


class ConfigError(UserError):
    """A configuration that cannot be used; the message names file and field."""


class BusError(DriveMcpError, ConnectionError):
    """The bus cannot be reached or refuses."""


class ToolFailed(DriveMcpError, RuntimeError):
    """Raised by a tool that cannot answer: what, which argument, and what to do. Becomes a result with `isError`."""

    def __init__(self, problem: str, *, field: str = "", do: str = "") -> None:
        """`field`: the argument that caused it, by its path; `do`: what the caller may do about it."""
        super().__init__(problem)
        self.field = field
        self.do = do


class ContractError(DriveMcpError, TypeError):
    """A service breaks the contract of the tables: an unknown topic, a tool name taken twice, an id where none belongs."""


class LockstepError(DriveMcpError, TimeoutError):
    """A simulated step was not finished within its wall bound; names the service that is stuck."""
