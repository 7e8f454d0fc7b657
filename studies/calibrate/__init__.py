"""`drivemcp calibrate`: fits the arbiter's constants and the event thresholds on the calibration split."""
