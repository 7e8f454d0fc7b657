"""Meshes and textures of road users, plants and buildings, built in code."""
