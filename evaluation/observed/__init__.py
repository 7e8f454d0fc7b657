"""Modelled sensors: what perception and drivelm say, drawn from a model that was fitted to what they said of pictures."""
