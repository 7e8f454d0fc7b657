"""The question to the Rules, and the limits that begin ahead."""
