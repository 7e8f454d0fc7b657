"""Feeds recordings through the sensor topics: videos, pictures, webcams, LiDAR frames, our own logs, and CAN logs beside them."""
