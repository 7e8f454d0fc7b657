"""Rulepacks on disk: their format, read, checked, merged and verified."""
