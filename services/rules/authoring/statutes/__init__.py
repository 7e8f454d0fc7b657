"""Statutes in their publishers' formats, read as drafts of a pack."""
