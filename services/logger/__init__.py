"""The log: hash-chained MCAP, long-term memory, live view."""
