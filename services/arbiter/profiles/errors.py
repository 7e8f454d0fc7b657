"""What can be wrong with the arbiter's settings."""


class ProfileError(ValueError):
    """A profile file is not one: a constant missing, unknown, out of bounds or without its source."""
