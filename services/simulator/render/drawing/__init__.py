"""Drawing one picture or its labels: camera view, light, ground, static world, glow."""
