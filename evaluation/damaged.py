"""What reading a run's compressed files raises where they cannot be used."""

import zlib

DAMAGED = (OSError, EOFError, zlib.error)
"""The file is not there or no gzip file, is cut, or is spoiled."""
