"""What the arbiter remembers: what was said, what feedback has moved."""
