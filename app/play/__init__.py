"""A recording through the stack: `drivemcp play`."""
