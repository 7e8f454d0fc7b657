"""Checks on a backend's answers before they are believed."""
