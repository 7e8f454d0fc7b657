"""What can go wrong here, besides a sick car."""


class CanError(Exception):
    """Root of the CAN service's errors."""


class ProfileError(CanError, ValueError):
    """A vehicle profile that does not fit its DBC."""


class RequestRefused(CanError, PermissionError):
    """A request that may not leave on the bus."""


class HeldBack(CanError, PermissionError):
    """What may not leave the service."""


class MalformedFrame(CanError, ValueError):
    """Bytes that are no frame of the protocol."""


class LinkDown(CanError, TimeoutError):
    """A bus that cannot be reached now; its link keeps trying."""
