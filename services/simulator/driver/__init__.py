"""The simulated driver: his profile, what lies ahead of him, the signs he understands, and how he drives."""
