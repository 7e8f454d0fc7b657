"""The speed limit in force: candidates, conditions, precedence and the answer."""
