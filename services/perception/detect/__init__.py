"""Object detectors: models behind one interface, and the boxes they find."""
