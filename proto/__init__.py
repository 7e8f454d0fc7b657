"""The messages on the wire. Imports msgspec and the standard library only."""

PROTO_VERSION = (1, 0)
"""(major, minor). A peer that speaks another major version is refused; minor versions only add fields with defaults."""
