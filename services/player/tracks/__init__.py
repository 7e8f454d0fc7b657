"""Readers of position tracks, one for each format."""
