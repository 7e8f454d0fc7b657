"""What one source says: intervals, observations, and claims of one quantity."""
