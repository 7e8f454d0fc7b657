"""A log as bytes: the MCAP container, the hash chain, signed heads, and reading what may be damaged."""
