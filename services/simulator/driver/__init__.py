"""The simulated driver: the profile, what lies ahead, the signs that the driver understands, and how the driver drives."""
