"""The lane a point lies in, and the lead vehicle in the ego's lane."""
