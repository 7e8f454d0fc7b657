"""`drivemcp evaluate`: the paper's tables, driven, measured and set beside the paper's numbers."""
