"""How well Weather knows the friction of the simulated road."""
