"""The road of a scenario: geometry, lanes, markings, signs, gantries, traffic lights and stop lines."""
