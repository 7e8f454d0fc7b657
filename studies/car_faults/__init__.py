"""Faults of the car and of its sensors, told apart: a seeded set of drives through the car's own bus."""
