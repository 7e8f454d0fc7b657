"""Making what the models learn from, fitting them, and measuring what they know."""
