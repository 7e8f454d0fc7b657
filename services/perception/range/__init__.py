"""The camera model, and the range of a box by LiDAR, ground contact or size."""
