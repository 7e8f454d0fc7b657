"""What could be said, what is chosen, how it is worded, and what was said."""
