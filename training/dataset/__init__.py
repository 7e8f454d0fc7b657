"""Rendered pictures with labels, kept as shards."""
