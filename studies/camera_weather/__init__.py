"""What the camera tells of the weather, beside the truth."""
