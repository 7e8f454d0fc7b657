"""`drivemcp calibrate`: fits the arbiter's constants and the event thresholds on the calibration split.

Flat: one program, a module for each of its steps.
"""
