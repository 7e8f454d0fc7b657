"""Whether a log is as it was written, and where it first is not."""
