"""Perception and the front end modelled from truth, by errors that were fitted to rendered runs."""
