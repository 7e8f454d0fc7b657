"""Measurements of single parts, outside the paper's tables: `python -m studies NAME`."""
