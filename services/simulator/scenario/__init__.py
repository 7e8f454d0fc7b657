"""Scenario files: their fields, how they are read, and the law along their route."""
