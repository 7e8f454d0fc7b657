"""The messages on the wire. Imports msgspec and the standard library only.

Flat: each module is one group of messages, and every package imports it by that name.
"""

PROTO_VERSION = (1, 0)
"""(major, minor). A peer that speaks another major version is refused; minor versions only add fields with defaults."""
