"""Sign codes of the readers, and what a sign means."""
