"""How well road users are tracked: rendered drives with truth, scored by standard metrics.

Flat: one program, a module for each of its steps.
"""
