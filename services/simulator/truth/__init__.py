"""The truth about a drive, kept for evaluation: hazards, infractions, line of sight, and the message that publishes them."""
