"""Which tools a tick asks, and what their answers change."""
