"""How far off the ranges of detected objects are, on a labelled frame with LiDAR."""
