"""The same traffic with what one would take instead of an assistant: a car-following model, and a governor by RSS."""
