"""`drivemcp evaluate isa`: what the driver is shown and told of limits, by the yardstick of speed assistance."""
