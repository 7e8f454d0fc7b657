"""Photographs of signs for training and measuring: what others published, read where it lies, and never kept in this repository."""
