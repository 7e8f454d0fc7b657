"""Why a field has no value that can be used: what a reading says of itself, and what the checks of sensors go by."""

NEVER_SEEN = "never seen"
SILENT = "silent"
OUT_OF_RANGE = "out of range"
JUMPED = "implausible jump"
INVALID = "marked invalid by the sender"
NOT_AVAILABLE = "marked not available by the sender"
UNKNOWN_VALUE = "not a known value"
TOO_SHORT = "frame too short"
WRONG_CHECKSUM = "wrong checksum"
REPEATED = "sender repeats itself"

GONE = frozenset({NEVER_SEEN, SILENT, OUT_OF_RANGE, INVALID, TOO_SHORT, WRONG_CHECKSUM})
"""A sensor of which that stays true is missing. One that its sender marks as not available may not be in this car."""
