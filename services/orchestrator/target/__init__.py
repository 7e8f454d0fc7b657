"""The target speed and its bounds."""
