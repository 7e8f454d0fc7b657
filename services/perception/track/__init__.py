"""Tracks over time: road users in the ego frame, signs and lights in the picture."""
