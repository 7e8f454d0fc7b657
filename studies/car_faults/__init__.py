"""How well faults of the car and of its sensors are distinguished, in a seeded set of drives through the car's own bus."""
