"""The GLSL programs."""
