"""A guard against another distribution's top-level `proto` package (proto-plus) in place of ours."""

from drivemcp.errors import UserError


def check_proto() -> None:
    """Raise UserError, saying what to do, when `import proto` brings something else than our messages."""
    import proto

    if not hasattr(proto, "PROTO_VERSION"):
        raise UserError(
            f"the package 'proto' at {getattr(proto, '__file__', '?')} is not DriveMCP's: another distribution "
            "(proto-plus, brought by google-cloud packages or ray[default]) shadows it; uninstall it or use an environment of its own"
        )
