"""Seeded corruption between the sensors and `world_state`: what is missed, misread, lost, dark, frozen or late."""
