"""Perception: boxes in pictures, tracked actors in the ego frame, lanes."""
