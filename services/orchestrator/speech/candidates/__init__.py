"""Makers of candidates: each finds what could be said about one matter."""
