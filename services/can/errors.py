"""What can go wrong here, besides a sick car."""


class CanError(Exception):
    """Root of the CAN service's errors."""


class ProfileError(CanError, ValueError):
    """A vehicle profile that does not fit its DBC."""


class UnknownSignal(ProfileError):
    """A signal that no bus description has."""

    def __init__(self, name: str, do: str) -> None:
        """`do`: the nearest names, or where they are listed."""
        super().__init__(f"no signal {name!r} in the bus description")
        self.do = do


class RequestRefused(CanError, PermissionError):
    """A request that may not leave on the bus."""


class HeldBack(CanError, PermissionError):
    """What may not leave the service."""


class MalformedFrame(CanError, ValueError):
    """Bytes that are no frame of the protocol."""


class LinkDown(CanError, TimeoutError):
    """A bus that cannot be reached now; its link keeps trying."""
