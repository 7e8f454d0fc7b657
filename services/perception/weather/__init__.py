"""The weather from camera pictures."""
