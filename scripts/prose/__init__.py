"""Checks the language of pages and docstrings: `python -m scripts.prose`."""
