"""Training of the models that are shipped: `python -m training NAME`."""
