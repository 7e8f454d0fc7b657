"""Pedestrians: how they walk, wait and cross."""
