"""The Weather service: grip, sight, and what they ask of speed and distance."""
