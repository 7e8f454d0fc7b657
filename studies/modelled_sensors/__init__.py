"""Fits the model of observations to runs and compares it with them."""
