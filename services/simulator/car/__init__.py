"""The simulated car itself: motion, brakes, tyres, sensors, faults, and the monitors that detect faults."""
