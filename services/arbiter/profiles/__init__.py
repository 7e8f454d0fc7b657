"""The constants of the arbiter, each with symbol, unit, source and reason, and the check that ACT can be reached."""
