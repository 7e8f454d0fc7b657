"""The world as cameras and LiDAR see it: frozen values that world, sensors and renderer share."""
