"""The driver's questions, preferences and labels."""
