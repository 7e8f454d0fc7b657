"""What the sensors measure at one instant: LiDAR, position, weather, map, and the cameras in a process of their own."""
