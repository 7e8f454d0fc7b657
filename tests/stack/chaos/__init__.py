"""Whole drives that are disturbed on purpose: what disturbs, what watches, what judges."""
