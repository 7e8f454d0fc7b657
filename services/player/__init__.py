"""Feeds recordings through the sensor topics: a video file, or a folder of pictures."""
