"""How well road users are tracked: rendered drives with truth, scored by standard metrics."""
