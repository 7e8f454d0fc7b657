"""Scores answers to DriveLM's questions as its challenge does, offline: exact match, coordinate match, language.

Flat: one program, a module for each of its steps.
"""
