"""Signs seen, the limits that they set, and what ends a limit."""
