"""Passages ranked in memory: text analysis, the index and its tuned weights."""
