"""The simulated world: road, traffic, people, weather, driver and sensors."""
