"""One drive: the stack as processes, the live line, the summary."""
