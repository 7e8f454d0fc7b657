"""Photographs of roads that others labelled, read where they lie and never kept in this repository: crops of signs, scenes, shards."""
