"""Deciding again from a log: the same decisions, or what others there would have been."""
